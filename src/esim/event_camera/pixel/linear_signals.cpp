#include "esim/event_camera/pixel/linear_signals.h"

#include "esim/core/vector_math.h"

namespace esim::inline event_camera {

void LinearSignals::take(const ActivePixels& active, std::size_t first, double duration) {
  duration_ = duration, per_duration_ = 1 / duration;
  for (std::size_t i = first; i < active.count; ++i) start_[i] = active.start[i], end_[i] = active.end[i];
}

void LinearSignals::take_light(const ActivePixels& active, std::size_t first, double eps, double duration) {
  duration_ = duration, per_duration_ = 1 / duration;
  for (std::size_t i = first; i < active.count; ++i)
    start_[i] = active.light0[i] + eps, end_[i] = active.light1[i] + eps;
  logarithms(active.count - first, start_.data() + first);
  logarithms(active.count - first, end_.data() + first);
}

void LinearSignals::find(Comparators& c) const {
  const double duration = duration_;
#pragma omp simd
  for (std::size_t i = 0; i < c.count; ++i) {
    const double rate = slope(i) + c.drift[i], last = end_[i] + c.drift[i] * duration;
    const double upper = c.upper(i), lower = c.lower(i), from = c.from[i];
    const bool on = last >= upper, off = last <= lower;
    double tau = rate != 0 ? ((on ? upper : lower) - start_[i]) / rate : from;
    tau = tau > from ? tau : from;
    c.tau[i] = tau < duration ? tau : duration;
    c.polarity[i] = on ? 1.0 : (off ? -1.0 : 0.0);
  }
}

void LinearSignals::advance(const Comparators& c) {
#pragma omp simd
  for (std::size_t i = 0; i < c.count; ++i) value_[i] = start_[i] + slope(i) * c.from[i];
}

void LinearSignals::look_ahead(const Comparators& c, double* again) const {
#pragma omp simd
  for (std::size_t i = 0; i < c.count; ++i) {
    const double last = end_[i] + c.drift[i] * duration_;
    again[i] = last >= c.upper(i) || last <= c.lower(i) ? 1.0 : 0.0;
  }
}

}  // namespace esim::inline event_camera
