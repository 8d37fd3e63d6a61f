#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "esim/dataset/generators/magnitudes.h"
#include "esim/scene/sprite.h"

namespace esim::inline dataset {

/// The strength of each kind of motion: standard deviations of normal distributions of the optical flow (root mean
/// square over the image) that this kind alone causes. Only their ratios matter.
struct MotionMix {
  double translation = 1.0;
  double rotation = 0.5;
  double scale = 0.3;
  double shear = 0.2;  ///< and stretch
};

/// An affine motion of an image about the centre of the sensor.
struct AffineMotion {
  std::array<SpritePose, 3> poses{};  ///< at the start, half-way and at the end

  /// Root mean square over the sensor's pixels of the optical flow from the start to the end, px.
  double optical_flow_rms_px = 0;
};

/// An affine map of pixels about the centre of the sensor: p -> p + d(p).
struct AffineFlow {
  Eigen::Matrix2d gradient = Eigen::Matrix2d::Zero();
  Eigen::Vector2d at_middle = Eigen::Vector2d::Zero();

  Eigen::Vector2d at(const Eigen::Vector2d& from_middle) const { return at_middle + gradient * from_middle; }
};

/// The map from one placement of a sprite to another, on a sensor of this size.
AffineFlow flow_between(const SpritePlacement& from, const SpritePlacement& to, PixelSize sensor);

/// The initial rotation and scale of a sprite.
struct AffineStart {
  double rotation_deg = 0;
  double scale = 1;  ///< px per texel
};

/// Random motion `number` of a seed, scaled so that its optical flow has the root mean square `rms_px`. Its speed
/// changes smoothly, by up to a third, and differently for each kind of motion, so that paths are curved.
AffineMotion draw_motion(const MotionMix& mix, PixelSize sensor, const AffineStart& start, double duration_s,
                         double rms_px, std::uint64_t seed, std::uint32_t number);

/// The distribution of motion strengths for which the magnitudes of optical flow follow `target`.
///
/// Within one sequence, magnitudes differ from pixel to pixel. Let K(b | a) be the fraction of pixels in bin b of
/// sequences whose root mean square is in bin a, estimated from random motions. The fractions p(a) of sequences solve
///     target(b) = sum_a K(b | a) p(a)
/// The Richardson-Lucy iteration finds them and keeps p positive.
MagnitudeHistogram strengths_for(const MagnitudeHistogram& target, const MotionMix& mix, PixelSize sensor);

}  // namespace esim::inline dataset
