#pragma once

#include <cstdint>
#include <limits>

namespace esim::inline stats {

/// The Fano factor of counts: their variance over their mean, in consecutive bins from the first event on. The last
/// bin, which is not complete, does not count. It is 1 for a Poisson process, and larger if events come in bursts.
class Fano {
 public:
  /// Sums over complete bins.
  struct Sums {
    std::uint64_t bins = 0, events = 0, squares = 0;

    void add(const Sums& other, std::uint64_t times = 1) {
      bins += times * other.bins, events += times * other.events, squares += times * other.squares;
    }
    /// NaN with fewer than two bins or without events in them.
    double factor() const {
      if (bins < 2 || events == 0) return std::numeric_limits<double>::quiet_NaN();
      const auto n = static_cast<double>(bins);
      const double mean = static_cast<double>(events) / n;
      return static_cast<double>(squares) / n / mean - mean;
    }
  };

  explicit Fano(std::int64_t bin_us) : bin_us_(bin_us) {}

  /// Time since the first event, us; never decreasing. Bins that are complete by then are added to `sums`.
  void add(std::int64_t since_start_us, Sums& sums) {
    const std::int64_t bin = since_start_us / bin_us_;
    if (bin != bin_) {
      sums.add({static_cast<std::uint64_t>(bin - bin_), count_, count_ * count_});
      count_ = 0;
      bin_ = bin;
    }
    ++count_;
  }

 private:
  std::int64_t bin_us_, bin_ = 0;
  std::uint64_t count_ = 0;  // in the open bin
};

}  // namespace esim::inline stats
