#pragma once

#include "esim/core/image.h"
#include "esim/events/event.h"
#include "esim/record/format.h"
#include "esim/record/preview/colours.h"

namespace esim {

/// The cells of a picture: the sensor's pixels or, for large sensors, blocks of them.
struct PictureGrid {
  SensorSize sensor{};
  int width = 0, height = 0;  ///< cells; at least 1, at most as many as pixels

  int column(int x) const { return static_cast<int>(std::int64_t{x} * width / sensor.width); }
  int row(int y) const { return static_cast<int>(std::int64_t{y} * height / sensor.height); }
};

/// As many cells as the sensor has pixels, but at most `width` x `height`.
PictureGrid picture_grid(SensorSize sensor, int width, int height);

/// Number of events per cell.
struct EventCounts {
  Image<float> on, off;
};

/// Counts every event, each once. All must lie on the sensor.
EventCounts count_events(EventSpan events, const PictureGrid& grid);

/// When each cell had its latest event: the surface of active events.
class TimeSurface {
 public:
  explicit TimeSurface(const PictureGrid& grid);

  /// Events in order, on the sensor.
  void add(EventSpan events);

  /// exp(-(t - t_last) / tau), in the sign of the polarity of the cell's latest event; 0 where there was none. `t` is
  /// not before any event; `tau` is positive, ns.
  float value(int column, int row, TimeNs t, double tau_ns) const;

  /// Each cell in the colour of its latest event's polarity, faded towards `ground` as value() decays.
  Image<Rgb> draw(TimeNs t, double tau_ns, Rgb ground) const;

 private:
  PictureGrid grid_;
  Image<TimeNs> latest_;
  Image<std::int8_t> polarity_;  // 0: no event yet
};

}  // namespace esim
