#pragma once

#include "esim/core/image.h"
#include "esim/events/event.h"
#include "esim/record/format.h"
#include "esim/record/preview/canvas.h"
#include "esim/visualise/theme.h"

namespace esim {

/// What a space-time plot spans: the sensor's pixels, and the times from start to end (start < end).
struct SpaceTimeBox {
  SensorSize sensor{};
  TimeNs start = 0, end = 0;
  TimeNs origin = 0;  ///< the time that the axis calls 0
};

/// From where it is seen. At yaw 0 one looks along the time axis, at the sensor's image at the end of the time.
struct SpaceTimeView {
  double yaw_deg = 0;
  double pitch_deg = 0;  ///< from above
};

/// The sines and cosines of a view's angles.
struct ViewTurn {
  explicit ViewTurn(const SpaceTimeView& view);
  double sin_yaw, cos_yaw, sin_pitch, cos_pitch;
};

/// The view at a share (0 to 1) of a video: a slow turn to and fro.
SpaceTimeView turned_view(double share);

/// Perspective onto a part of a picture that holds the box and its labels, from any of the turned_view()s.
class SpaceTimeProjection {
 public:
  SpaceTimeProjection(const SpaceTimeBox& box, const SpaceTimeView& view, const Tile& area);

  struct Place {
    Spot spot;            ///< px
    double distance = 0;  ///< from the viewer
    double scale = 0;     ///< size of a pixel of the sensor there, px
  };
  /// Of pixel coordinates and a time, also beyond the box.
  Place place(double x, double y, double t_ns) const;

 private:
  SpaceTimeBox box_;
  ViewTurn turn_;
  double scale_ = 1;  // px of the picture per longer side of the sensor
  Spot centre_{};     // of the picture, where the middle of the box is seen
};

/// Events (those within the box) as points in x, y and time, coloured by polarity, fainter with distance, between
/// axes with ticks.
Image<Rgb> draw_space_time(EventSpan events, const SpaceTimeBox& box, const SpaceTimeView& view, int width, int height,
                           const Theme& theme);

}  // namespace esim
