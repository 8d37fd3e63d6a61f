#pragma once

#include <Eigen/Core>
#include <vector>

#include "esim/core/time.h"

namespace esim::inline scene {

/// The units of a sprite's positions and scales.
enum class SpriteUnits {
  pixel,   ///< pixels; at scale 1 a texel is as large as a pixel
  sensor,  ///< fractions of the sensor's width and height; at scale 1 the image fills the sensor
};

/// What a sprite shows outside its image.
enum class SpriteBeyond { nothing, clamp, mirror, repeat };

/// How a sprite moves from one pose to the next.
enum class SpriteInterpolation {
  spline,  ///< natural cubic splines of position, rotation and scale: continuous velocity and acceleration
  linear,  ///< constant rates of position, rotation and scale
};

/// The placement of a sprite on the sensor at one time.
struct SpritePose {
  double t_s = 0;
  Eigen::Vector2d position = Eigen::Vector2d::Zero();  ///< of the sprite's pivot from the sensor's centre, right, down
  double rotation_deg = 0;                             ///< about the pivot, clockwise on the screen
  Eigen::Vector2d scale = Eigen::Vector2d::Ones();     ///< along the image's rows and columns, before the rotation
  double shear = 0;  ///< shift to the right over distance downwards, after the scale and before the rotation
};

/// Motion through poses. Before the first and after the last pose the sprite rests.
class SpriteMotion {
 public:
  /// Position (2), rotation in radians, scale (2), shear.
  using Parameters = Eigen::Matrix<double, 6, 1>;
  struct State {
    Parameters value;
    Parameters rate;  ///< per second
  };

  /// Throws UserError unless there is at least one pose and their times increase.
  SpriteMotion(const std::vector<SpritePose>& poses, SpriteInterpolation interpolation);

  State at(TimeNs t) const;

 private:
  std::vector<double> t_s_;
  std::vector<Parameters> values_;
  std::vector<Parameters> accelerations_;  // second derivatives at the poses, per s^2
};

/// An affine map from an image to the sensor, and its rate of change:
///     pixel = centre + A (uv - 1/2),   with (u, v) on [0, 1] x [0, 1] in the image.
struct SpritePlacement {
  Eigen::Matrix2d A, A_rate;
  Eigen::Vector2d centre, centre_velocity;  ///< px, px/s
};

struct PixelSize {
  int width = 0, height = 0;
};

/// The placement of a sprite whose point `pivot`, in (u, v), is at the position. With U = 1 and I = diag(image's size)
/// in units of pixels, U = diag(sensor's size) and I = 1 in units of the sensor, and K = (1 shear; 0 1):
///     A = U R(rotation) K diag(scale) I,   centre = the sensor's centre + U position + A (1/2 - pivot).
SpritePlacement place(const SpriteMotion::State& state, SpriteUnits units, PixelSize image, PixelSize sensor,
                      const Eigen::Vector2d& pivot = {0.5, 0.5});

}  // namespace esim::inline scene
