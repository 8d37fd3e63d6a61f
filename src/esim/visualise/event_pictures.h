#pragma once

#include "esim/core/image.h"
#include "esim/events/event.h"
#include "esim/preview/colours.h"
#include "esim/recording/format.h"

namespace esim::inline visualise {

/// The cells of an image of events: the sensor's pixels or, for large sensors, blocks of pixels.
struct PictureGrid {
  SensorSize sensor{};
  int width = 0, height = 0;  ///< cells; from 1 to the number of pixels

  int column(int x) const { return static_cast<int>(std::int64_t{x} * width / sensor.width); }
  int row(int y) const { return static_cast<int>(std::int64_t{y} * height / sensor.height); }
};

/// One cell per pixel of the sensor, but at most `width` x `height` cells.
PictureGrid picture_grid(SensorSize sensor, int width, int height);

/// Number of events per cell.
struct EventCounts {
  Image<float> on, off;
};

/// Counts events. All must lie on the sensor.
EventCounts count_events(EventSpan events, const PictureGrid& grid);

/// The time of each cell's latest event: the surface of active events.
class TimeSurface {
 public:
  explicit TimeSurface(const PictureGrid& grid);

  /// Adds events, which must be in order and on the sensor.
  void add(EventSpan events);

  /// exp(-(t - t_last) / tau) with the sign of the polarity of the cell's latest event; 0 without an event. `t` must
  /// not be before any event; `tau_ns` > 0.
  float value(int column, int row, TimeNs t, double tau_ns) const;

  /// Draws each cell in the colour of its latest event's polarity, fading to `ground` as value() decays.
  Image<Rgb> draw(TimeNs t, double tau_ns, Rgb ground) const;

 private:
  PictureGrid grid_;
  Image<TimeNs> latest_;
  Image<std::int8_t> polarity_;  // 0: no event
};

}  // namespace esim::inline visualise
