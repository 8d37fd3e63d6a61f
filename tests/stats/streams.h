#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "esim/events/event.h"

namespace esim::test {

/// Times of a Poisson process, in order, ns.
inline std::vector<TimeNs> poisson_times(double rate_hz, double duration_s, unsigned seed) {
  std::mt19937_64 random(seed);
  std::exponential_distribution<double> wait(rate_hz);
  std::vector<TimeNs> times;
  for (double t = wait(random); t < duration_s; t += wait(random)) times.push_back(to_ns(t));
  return times;
}

/// Moves each time to one of a few stamps in its frame, as in simulators that work frame by frame.
inline std::vector<TimeNs> banded(std::vector<TimeNs> times, double frame_rate_hz, int stamps_per_frame) {
  const double step_ns = 1e9 / frame_rate_hz / stamps_per_frame;
  for (TimeNs& t : times) t = static_cast<TimeNs>(std::ceil(static_cast<double>(t) / step_ns) * step_ns);
  return times;
}

/// Events at these times, with uniformly drawn pixels and polarities.
inline std::vector<Event> events_at(const std::vector<TimeNs>& times, int width, int height, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Event> events;
  for (const TimeNs t : times) {
    events.push_back({t, static_cast<std::uint16_t>(random() % static_cast<unsigned>(width)),
                      static_cast<std::uint16_t>(random() % static_cast<unsigned>(height)),
                      static_cast<std::int8_t>(random() % 2 == 0 ? 1 : -1)});
  }
  std::sort(events.begin(), events.end());
  return events;
}

}  // namespace esim::test
