#include "esim/truth/clock.h"

namespace esim::inline truth {

void PeriodicClock::settle() {
  due_ = kNever;
  if (rate_hz_ <= 0) return;
  const double since_start_s = static_cast<double>(ticks_) / rate_hz_;
  if (since_start_s > to_seconds(end_ - start_) + 1) return;  // perhaps beyond the range of TimeNs
  const TimeNs t = start_ + to_ns(since_start_s);
  if (t <= end_) due_ = t;
}

}  // namespace esim::inline truth
