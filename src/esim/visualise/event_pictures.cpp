#include "esim/visualise/event_pictures.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace esim::inline visualise {

PictureGrid picture_grid(SensorSize sensor, int width, int height) {
  return {sensor, std::clamp(width, 1, sensor.width), std::clamp(height, 1, sensor.height)};
}

EventCounts count_events(EventSpan events, const PictureGrid& grid) {
  EventCounts counts{Image<float>(grid.width, grid.height), Image<float>(grid.width, grid.height)};
  for (const Event& event : events) {
    assert(event.x < grid.sensor.width && event.y < grid.sensor.height);
    ++(event.polarity > 0 ? counts.on : counts.off)(grid.column(event.x), grid.row(event.y));
  }
  return counts;
}

TimeSurface::TimeSurface(const PictureGrid& grid)
    : grid_(grid), latest_(grid.width, grid.height), polarity_(grid.width, grid.height) {}

void TimeSurface::add(EventSpan events) {
  for (const Event& event : events) {
    assert(event.x < grid_.sensor.width && event.y < grid_.sensor.height);
    const int column = grid_.column(event.x), row = grid_.row(event.y);
    latest_(column, row) = event.t;
    polarity_(column, row) = event.polarity > 0 ? 1 : -1;
  }
}

float TimeSurface::value(int column, int row, TimeNs t, double tau_ns) const {
  const int polarity = polarity_(column, row);
  if (polarity == 0) return 0;
  return static_cast<float>(polarity * std::exp(-static_cast<double>(t - latest_(column, row)) / tau_ns));
}

Image<Rgb> TimeSurface::draw(TimeNs t, double tau_ns, Rgb ground) const {
  constexpr float kFaded = 7;  // age in tau at which less than one level of any colour remains
  Image<Rgb> out(grid_.width, grid_.height, ground);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const int polarity = polarity_.pixels()[i];
    const float age = static_cast<float>(static_cast<double>(t - latest_.pixels()[i]) / tau_ns);
    if (polarity == 0 || age > kFaded) continue;
    out.pixels()[i] = mix(ground, polarity > 0 ? kOnColour : kOffColour, std::exp(-age));
  }
  return out;
}

}  // namespace esim::inline visualise
