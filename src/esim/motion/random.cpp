#include "esim/motion/random.h"

#include <fmt/format.h>

#include <cmath>
#include <string_view>
#include <utility>
#include <vector>

#include "esim/core/error.h"
#include "esim/core/random.h"
#include "esim/geometry/so3.h"

namespace esim::inline motion {

namespace {

constexpr double kMaxControlPoints = 1e7;

void require(bool valid, std::string_view field, std::string_view rule) {
  if (!valid) throw UserError(fmt::format("random motion: {} {}", field, rule));
}

void validate(const RandomMotionOptions& options, TimeNs duration) {
  const auto amplitude = [](const Eigen::Vector3d& v) { return v.allFinite() && v.minCoeff() >= 0.0; };
  require(amplitude(options.position_amplitude_m), "position_amplitude_m", "must be finite and not negative");
  require(amplitude(options.rotation_amplitude_rad), "rotation_amplitude_rad", "must be finite and not negative");
  require(options.order >= kMinSplineOrder && options.order <= kMaxSplineOrder, "order",
          fmt::format("must be in {} .. {}, not {}", kMinSplineOrder, kMaxSplineOrder, options.order));
  require(options.knot_interval_s > 0.0 && std::isfinite(options.knot_interval_s), "knot_interval_s",
          fmt::format("must be positive and finite, not {}", options.knot_interval_s));
  require(duration > 0, "duration", fmt::format("must be positive, not {} ns", duration));
  require(to_seconds(duration) / options.knot_interval_s < kMaxControlPoints, "knot_interval_s",
          fmt::format("is too short for a motion of {} s: choose more than {} s", to_seconds(duration),
                      to_seconds(duration) / kMaxControlPoints));
  require(options.center.translation.allFinite() && std::abs(options.center.rotation.norm() - 1.0) < 1e-3, "center",
          "must have a finite translation and a quaternion of unit norm");
}

/// Uniform in ± amplitude, per axis.
Eigen::Vector3d draw(const AddressedRandom& random, int control_point, const Eigen::Vector3d& amplitude) {
  Eigen::Vector3d value;
  for (int axis = 0; axis < 3; ++axis) {
    const double uniform =
        random.uniforms(static_cast<std::uint32_t>(axis), static_cast<std::uint64_t>(control_point))[0];
    value[axis] = amplitude[axis] * (2.0 * uniform - 1.0);
  }
  return value;
}

}  // namespace

SplineTrajectory random_trajectory(const RandomMotionOptions& options, TimeNs start, TimeNs duration,
                                   std::uint64_t seed, std::uint16_t stream) {
  validate(options, duration);
  const int segments = static_cast<int>(std::ceil(to_seconds(duration) / options.knot_interval_s));
  const SE3 center{options.center.rotation.normalized(), options.center.translation};
  const AddressedRandom position_random(seed, Purpose::trajectory_position, stream);
  const AddressedRandom rotation_random(seed, Purpose::trajectory_rotation, stream);

  std::vector<Eigen::Quaterniond> rotations;
  std::vector<Eigen::Vector3d> positions;
  for (int j = 0; j < segments + options.order - 1; ++j) {
    const Eigen::Vector3d angles = draw(rotation_random, j, options.rotation_amplitude_rad);
    const SE3 local{so3_exp(angles.x() * Eigen::Vector3d::UnitX()) * so3_exp(angles.y() * Eigen::Vector3d::UnitY()) *
                        so3_exp(angles.z() * Eigen::Vector3d::UnitZ()),
                    draw(position_random, j, options.position_amplitude_m)};
    const SE3 control = center * local;
    rotations.push_back(control.rotation);
    positions.push_back(control.translation);
  }
  return {Se3Spline(options.order, 0.0, options.knot_interval_s, std::move(rotations), std::move(positions)), start,
          start + duration};
}

}  // namespace esim::inline motion
