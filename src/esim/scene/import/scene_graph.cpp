#include "esim/scene/import/scene_graph.h"

#include <fmt/format.h>

namespace esim::inline scene {

Eigen::Matrix4d local_transform(const GraphNode& node, double t_s) { return moving_local_transform(node, t_s).value; }

MovingTransform moving_local_transform(const GraphNode& node, double t_s) {
  if (node.matrix) return {*node.matrix, Eigen::Matrix4d::Zero()};
  const auto property = [&](const Track& track, const Eigen::Vector4d& at_rest, bool is_rotation) {
    return track.times_s.empty() ? TrackSample{at_rest, Eigen::Vector4d::Zero()} : sample_at(track, t_s, is_rotation);
  };
  const TrackSample translation = property(node.translation_track, node.translation.homogeneous(), false);
  const TrackSample rotation = property(node.rotation_track, node.rotation.coeffs(), true);
  const TrackSample scale = property(node.scale_track, node.scale.homogeneous(), false);
  const Eigen::Quaterniond q(rotation.value), q_slope(rotation.slope);
  const Eigen::Matrix3d R = q.toRotationMatrix();
  MovingTransform transform;
  transform.value.topLeftCorner<3, 3>() = R * scale.value.head<3>().asDiagonal();
  transform.value.topRightCorner<3, 1>() = translation.value.head<3>();
  // dR/dt = [w]x R with the angular velocity w = 2 dq/dt q*.
  const Eigen::Vector3d w = 2 * (q_slope * q.conjugate()).vec();
  for (Eigen::Index i = 0; i < 3; ++i)
    transform.slope.col(i).head<3>() = scale.value[i] * w.cross(R.col(i)) + scale.slope[i] * R.col(i);
  transform.slope.topRightCorner<3, 1>() = translation.slope.head<3>();
  return transform;
}

void fail_scene(const std::filesystem::path& file, const std::string& reason) {
  throw UserError(fmt::format("scene {}: {}", file.string(), reason));
}

}  // namespace esim::inline scene
