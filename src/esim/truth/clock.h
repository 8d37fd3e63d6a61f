#pragma once

#include <cstdint>
#include <limits>

#include "esim/core/time.h"

namespace esim::inline truth {

/// The instants start + k / rate, k = 0, 1, ..., up to and including the end; none for a rate of 0. Each is computed
/// from k, so that rounding does not accumulate.
class PeriodicClock {
 public:
  static constexpr TimeNs kNever = std::numeric_limits<TimeNs>::max();

  PeriodicClock() = default;
  PeriodicClock(TimeNs start, TimeNs end, double rate_hz) : start_(start), end_(end), rate_hz_(rate_hz) { settle(); }

  /// The next instant; kNever after the last one.
  TimeNs due() const { return due_; }

  void advance() {
    ++ticks_;
    settle();
  }

 private:
  void settle();

  TimeNs start_ = 0, end_ = 0;
  double rate_hz_ = 0;
  std::int64_t ticks_ = 0;
  TimeNs due_ = kNever;
};

}  // namespace esim::inline truth
