#include "esim/visualise/event_pictures.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace esim {

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
  Image<Rgb> out(grid_.width, grid_.height, ground);
  for (int row = 0; row < grid_.height; ++row) {
    for (int column = 0; column < grid_.width; ++column) {
      const float now = value(column, row, t, tau_ns);
      out(column, row) = mix(ground, now > 0 ? kOnColour : kOffColour, std::abs(now));
    }
  }
  return out;
}

}  // namespace esim
