#include "esim/scene/import/scene_graph.h"

#include <fmt/format.h>

#include <algorithm>

namespace esim::inline scene {
namespace {

Eigen::Vector4d normalised(const Eigen::Vector4d& rotation) {
  const double norm = rotation.norm();
  return norm > 1e-9 ? Eigen::Vector4d(rotation / norm) : Eigen::Vector4d::UnitW();
}

/// Interpolates between two rotations at a constant rate, along the shorter rotation.
Eigen::Vector4d turned(const Eigen::Vector4d& from, const Eigen::Vector4d& to, double fraction) {
  return Eigen::Quaterniond(normalised(from)).slerp(fraction, Eigen::Quaterniond(normalised(to))).coeffs();
}

/// The Hermite spline between key i and the next; `s` goes from 0 to 1 in `interval_s`.
Eigen::Vector4d hermite(const Track& track, std::size_t i, double s, double interval_s) {
  const Eigen::Vector4d &from = track.values[3 * i + 1], &leaving = track.values[3 * i + 2];
  const Eigen::Vector4d &arriving = track.values[3 * i + 3], &to = track.values[3 * i + 4];
  const double s2 = s * s, s3 = s2 * s;
  return (2 * s3 - 3 * s2 + 1) * from + interval_s * (s3 - 2 * s2 + s) * leaving + (3 * s2 - 2 * s3) * to +
         interval_s * (s3 - s2) * arriving;
}

}  // namespace

Eigen::Vector4d value_at(const Track& track, double t_s, bool is_rotation) {
  const bool cubic = track.interpolation == Interpolation::cubic;
  const auto key = [&](std::size_t i) -> const Eigen::Vector4d& { return track.values[cubic ? 3 * i + 1 : i]; };
  const std::vector<double>& times = track.times_s;

  const auto after = static_cast<std::size_t>(std::upper_bound(times.begin(), times.end(), t_s) - times.begin());
  Eigen::Vector4d value;
  if (after == 0) {
    value = key(0);
  } else if (after == times.size() || track.interpolation == Interpolation::step) {
    value = key(after - 1);
  } else {
    const double interval_s = times[after] - times[after - 1], s = (t_s - times[after - 1]) / interval_s;
    if (cubic) {
      value = hermite(track, after - 1, s, interval_s);
    } else if (is_rotation) {
      return turned(key(after - 1), key(after), s);
    } else {
      value = key(after - 1) + s * (key(after) - key(after - 1));
    }
  }
  return is_rotation ? normalised(value) : value;
}

bool varies(const Track& track) {
  constexpr double kNegligible = 1e-7;  // relative to the values, which have single precision
  const bool cubic = track.interpolation == Interpolation::cubic;
  for (std::size_t i = 0; i < track.values.size(); ++i) {
    const bool is_slope = cubic && i % 3 != 1;
    const Eigen::Vector4d still = is_slope ? Eigen::Vector4d::Zero() : track.values[cubic ? 1 : 0];
    if ((track.values[i] - still).norm() > kNegligible * std::max(1.0, still.norm())) return true;
  }
  return false;
}

Eigen::Matrix4d local_transform(const GraphNode& node, double t_s) {
  if (node.matrix) return *node.matrix;
  const auto property = [&](const Track& track, const Eigen::Vector4d& at_rest, bool is_rotation) {
    return track.times_s.empty() ? at_rest : value_at(track, t_s, is_rotation);
  };
  const Eigen::Vector4d translation = property(node.translation_track, node.translation.homogeneous(), false);
  const Eigen::Vector4d rotation = property(node.rotation_track, node.rotation.coeffs(), true);
  const Eigen::Vector4d scale = property(node.scale_track, node.scale.homogeneous(), false);
  Eigen::Matrix4d transform = Eigen::Matrix4d::Identity();
  transform.topLeftCorner<3, 3>() = Eigen::Quaterniond(rotation).toRotationMatrix() * scale.head<3>().asDiagonal();
  transform.topRightCorner<3, 1>() = translation.head<3>();
  return transform;
}

void fail_scene(const std::filesystem::path& file, const std::string& reason) {
  throw UserError(fmt::format("scene {}: {}", file.string(), reason));
}

}  // namespace esim::inline scene
