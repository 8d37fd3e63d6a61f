#include "esim/truth/clock.h"

namespace esim {

void PeriodicClock::settle() {
  const TimeNs t = rate_hz_ > 0 ? start_ + to_ns(static_cast<double>(ticks_) / rate_hz_) : kNever;
  due_ = t <= end_ ? t : kNever;
}

}  // namespace esim
