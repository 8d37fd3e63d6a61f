#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

namespace esim::inline stats {

/// Counts pairs of events of a row at different times, by their distance. A row that is read some time after its first
/// request collects the events that occur meanwhile, so that pairs at shorter distances are missing: the fraction that
/// is left at a distance is the probability that the row has been read by then.
class RowPairs {
 public:
  static constexpr std::size_t kLongest_us = 128;

  /// The mean time from the first request of a row to its reading, us, with its standard deviation. NaN if there are
  /// too few pairs, or if rows wait for more than a quarter of kLongest_us.
  struct Wait {
    double mean_us = 0, deviation_us = 0;
  };
  Wait wait() const;

  /// Pairs at a distance of k + 1 us.
  const std::array<std::uint64_t, kLongest_us>& counts() const { return counts_; }

  /// In order of time, us.
  void add(std::int64_t t_us, std::uint16_t row);

 private:
  struct Stamp {
    std::int64_t t_us = 0;
    std::uint64_t events = 0;
  };

  std::array<std::uint64_t, kLongest_us> counts_{};
  std::vector<std::deque<Stamp>> recent_;  // time stamps of the last kLongest_us, of each row
};

}  // namespace esim::inline stats
