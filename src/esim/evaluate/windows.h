#pragma once

#include <string>
#include <vector>

#include "esim/evaluate/pixels.h"
#include "esim/sim/world.h"

namespace esim {

/// How fast the image moves over time: the motion field of some pixels at the instants start + k / rate.
struct MotionCurve {
  TimeNs start = 0;
  double rate_hz = 0;
  std::vector<double> mean_px_per_s;  ///< of |V| over the pixels, at each instant
  double greatest_px_per_s = 0;       ///< |V| of any pixel at any instant
  double fastest_turn_deg_per_s = 0;  ///< of the camera

  /// Mean over the instants in a span; of the nearest one where it holds none.
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

/// "slow" and "fast": the spans of the given length in which the mean motion is least and greatest; "all": the whole
/// time. Only "all" where the length exceeds half of it.
std::vector<Window> choose_windows(const MotionCurve& motion, const TimeSpan& all, double length_s);

/// The part of a window, of the given length or shorter if the window is, whose mean motion is nearest to the window's.
TimeSpan typical_part(const MotionCurve& motion, const Window& window, double length_s);

}  // namespace esim
