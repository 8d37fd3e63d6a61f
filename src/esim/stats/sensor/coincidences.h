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

    void add(const Pairs& other, std::uint64_t times = 1) {
      all += times * other.all, same_row += times * other.same_row, same_column += times * other.same_column;
    }
    double row_over_chance(int height) const { return over_chance(same_row, height); }
    double column_over_chance(int width) const { return over_chance(same_column, width); }

   private:
    double over_chance(std::uint64_t same, int places) const {
      return all == 0 ? std::numeric_limits<double>::quiet_NaN()
                      : static_cast<double>(same) / static_cast<double>(all) * places;
    }
  };

  /// In order of time, us. The pairs of this event with earlier ones are added to `same_us` if they have the same time
  /// stamp in us, and to `after` if they are 1 to 5 us apart.
  void add(std::int64_t t_us, std::uint16_t x, std::uint16_t y, Pairs& same_us, Pairs& after) {
    for (std::size_t back = 1; back <= kReach && back <= added_; ++back) {
      const Place& before = last_[(added_ - back) % kRing];
      const std::int64_t gap = t_us - before.t_us;
      if (gap > kAfter_us) break;
      Pairs& pairs = gap == 0 ? same_us : after;
      ++pairs.all;
      pairs.same_row += before.y == y;
      pairs.same_column += before.x == x;
    }
    last_[added_++ % kRing] = {t_us, x, y};
  }

 private:
  static constexpr std::size_t kReach = 199, kRing = 256;
  static constexpr std::int64_t kAfter_us = 5;
  struct Place {
    std::int64_t t_us = 0;
    std::uint16_t x = 0, y = 0;
  };
  std::array<Place, kRing> last_{};
  std::size_t added_ = 0;
};

}  // namespace esim::inline stats
