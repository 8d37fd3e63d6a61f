#pragma once

#include "esim/core/image.h"
#include "esim/events/event.h"
#include "esim/plot/canvas.h"
#include "esim/plot/theme.h"
#include "esim/recording/format.h"

namespace esim::inline visualise {

/// The extent of a space-time plot: the sensor's pixels, and the times from start to end (start < end).
struct SpaceTimeBox {
  SensorSize sensor{};
  TimeNs start = 0, end = 0;
  TimeNs origin = 0;  ///< time 0 of the axis
};

/// The direction of view. At yaw 0 it is along the time axis, towards the sensor's image at the end of the time.
struct SpaceTimeView {
  double yaw_deg = 0;
  double pitch_deg = 0;  ///< from above
};

/// The sines and cosines of a view's angles.
struct ViewTurn {
  explicit ViewTurn(const SpaceTimeView& view);
  double sin_yaw, cos_yaw, sin_pitch, cos_pitch;
};

/// The view at a fraction (0 to 1) of a video: a slow turn back and forth.
SpaceTimeView turned_view(double share);

/// Perspective projection into an area of an image, which holds the box and its labels in every turned_view().
class SpaceTimeProjection {
 public:
  SpaceTimeProjection(const SpaceTimeBox& box, const SpaceTimeView& view, const Tile& area);

  struct Place {
    Spot spot;            ///< px
    double distance = 0;  ///< from the viewer
    double scale = 0;     ///< size of a pixel of the sensor there, px
  };
  /// The place of pixel coordinates and a time, also outside the box.
  Place place(double x, double y, double t_ns) const;

 private:
  SpaceTimeBox box_;
  ViewTurn turn_;
  double scale_ = 1;  // px of the image per longer side of the sensor
  Spot centre_{};     // image of the middle of the box, px
};

/// Draws the events within the box as points in x, y and time, coloured by polarity and fading with distance, with axes
/// and ticks.
Image<Rgb> draw_space_time(EventSpan events, const SpaceTimeBox& box, const SpaceTimeView& view, int width, int height,
                           const Theme& theme);

}  // namespace esim::inline visualise
