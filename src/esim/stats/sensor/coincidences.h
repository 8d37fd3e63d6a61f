#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace esim::inline stats {

/// How often events that follow each other closely are of the same row, and of the same column. A pair consists of an
/// event and one of the next 199. Over chance: the fraction of pairs in the same row,
/// times the number of rows; 1 if rows are independent and equally frequent.
class Coincidences {
 public:
  struct Pairs {
    std::uint64_t all = 0, same_row = 0, same_column = 0;
    double row_over_chance(int height) const { return over_chance(same_row, height); }
    double column_over_chance(int width) const { return over_chance(same_column, width); }

   private:
    double over_chance(std::uint64_t same, int places) const {
      return all == 0 ? std::numeric_limits<double>::quiet_NaN()
                      : static_cast<double>(same) / static_cast<double>(all) * places;
    }
  };

  /// In order of time, us.
  void add(std::int64_t t_us, std::uint16_t x, std::uint16_t y) {
    for (std::size_t back = 1; back <= kReach && back <= added_; ++back) {
      const Place& before = last_[(added_ - back) % kRing];
      const std::int64_t gap = t_us - before.t_us;
      if (gap > kAfter_us) break;
      Pairs& pairs = gap == 0 ? same_us_ : after_;
      ++pairs.all;
      pairs.same_row += before.y == y;
      pairs.same_column += before.x == x;
    }
    last_[added_++ % kRing] = {t_us, x, y};
  }

  const Pairs& same_us() const { return same_us_; }  ///< with the same time stamp in us
  const Pairs& after() const { return after_; }      ///< 1 to 5 us later

 private:
  static constexpr std::size_t kReach = 199, kRing = 256;
  static constexpr std::int64_t kAfter_us = 5;
  struct Place {
    std::int64_t t_us = 0;
    std::uint16_t x = 0, y = 0;
  };
  std::array<Place, kRing> last_{};
  std::size_t added_ = 0;
  Pairs same_us_, after_;
};

}  // namespace esim::inline stats
