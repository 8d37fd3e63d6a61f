#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "esim/dataset/magnitudes.h"
#include "esim/scene/layer.h"

namespace esim {

/// How much of each kind of motion there is: standard deviations of normal distributions, each of the displacement
/// (root of its mean square over the image) that this kind alone makes. Only their ratios matter.
struct MotionMix {
  double translation = 1.0;
  double rotation = 0.5;
  double scale = 0.3;
  double shear = 0.2;  ///< and stretch
};

/// An affine motion of an image over the sensor about the middle of the sensor, in both of which pixels are alike.
struct AffineMotion {
  std::array<LayerKeyframe, 3> keyframes{};  ///< at the start, half-way and at the end

  /// The root of the mean over the sensor's pixels of the squared displacement from the start to the end, px.
  double displacement_rms_px = 0;
};

/// An affine map of pixels, about the middle of the sensor: p -> p + displacement(p).
struct AffineDisplacement {
  Eigen::Matrix2d gradient = Eigen::Matrix2d::Zero();
  Eigen::Vector2d at_middle = Eigen::Vector2d::Zero();

  Eigen::Vector2d at(const Eigen::Vector2d& from_middle) const { return at_middle + gradient * from_middle; }
};

/// From one placement of a layer to another, on a sensor of this size.
AffineDisplacement displacement_between(const LayerPlacement& from, const LayerPlacement& to, PixelSize sensor);

/// Where a layer begins: its rotation and its scale.
struct AffineStart {
  double rotation_deg = 0;
  double scale = 1;  ///< px per texel
};

/// The motion with the number `number` of a seed, so strong that its displacement has the root mean square `rms_px`.
/// Its speed changes smoothly, by up to a third, and differently for each kind of motion, so that paths are bent.
AffineMotion draw_motion(const MotionMix& mix, PixelSize sensor, const AffineStart& start, double duration_s,
                         double rms_px, std::uint64_t seed, std::uint32_t number);

/// How strong the motions of sequences must be for the magnitudes of their pixels' displacements to follow `target`.
///
/// Within one sequence, magnitudes differ from pixel to pixel. With K(b | a) the share of pixels in bin b of sequences
/// whose root mean square is in bin a, found by drawing motions, the shares p(a) of sequences solve
///     target(b) = sum_a K(b | a) p(a)
/// as Richardson and Lucy's iteration does, which keeps p positive.
MagnitudeHistogram strengths_for(const MagnitudeHistogram& target, const MotionMix& mix, PixelSize sensor);

}  // namespace esim
