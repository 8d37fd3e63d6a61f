#pragma once

#include <string>
#include <vector>

#include "esim/evaluate/pixels.h"
#include "esim/sim/world.h"

namespace esim::inline evaluate {

/// The speed of the image over time: the motion field of some pixels at the instants start + k / rate.
struct MotionCurve {
  TimeNs start = 0;
  double rate_hz = 0;
  std::vector<double> mean_px_per_s;  ///< mean |V| over the pixels, at each instant
  double max_px_per_s = 0;            ///< maximum |V| of all pixels and instants
  double fastest_turn_deg_per_s = 0;  ///< maximum angular speed of the camera

  /// Mean over the instants in a span; if it holds none, the value at the nearest one.
  double mean(const TimeSpan& span) const;
};

/// Measures the motion field of camera 0 over the world's time. Pixels whose motion is not finite do not count.
MotionCurve measure_motion(const World& world, const std::vector<PixelPosition>& pixels, double rate_hz);

/// A part of the simulated time.
struct Window {
  std::string name;
  TimeSpan span;
  double mean_px_per_s = 0;  ///< motion in it
};

/// "slow" and "fast": the spans of the given length with the smallest and the largest mean motion; "all": the whole
/// time. Only "all" if the length exceeds half of the time.
std::vector<Window> choose_windows(const MotionCurve& motion, const TimeSpan& all, double length_s);

/// The part of a window whose mean motion is nearest to the window's. It has the given length, or the window's if
/// shorter.
TimeSpan typical_part(const MotionCurve& motion, const Window& window, double length_s);

}  // namespace esim::inline evaluate
