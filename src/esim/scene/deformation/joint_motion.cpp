#include "esim/scene/deformation/joint_motion.h"

namespace esim::inline scene {
namespace {

bool is_animated(const GraphNode& node) {
  return varies(node.translation_track) || varies(node.rotation_track) || varies(node.scale_track);
}

/// Which nodes the joints depend on.
std::vector<bool> used_nodes(const std::vector<GraphNode>& nodes, const std::vector<JointMotion::Joint>& joints) {
  std::vector<bool> used(nodes.size());
  for (const JointMotion::Joint& joint : joints) {
    for (int i = joint.node; i >= 0 && !used[static_cast<std::size_t>(i)];
         i = nodes[static_cast<std::size_t>(i)].parent)
      used[static_cast<std::size_t>(i)] = true;
  }
  return used;
}

void store(const Eigen::Matrix4d& matrix, float* columns) {
  for (Eigen::Index column = 0; column < 4; ++column) {
    for (Eigen::Index row = 0; row < 3; ++row) columns[4 * column + row] = static_cast<float>(matrix(row, column));
  }
}

}  // namespace

JointMotion::JointMotion(const std::vector<GraphNode>& nodes, const std::vector<Joint>& joints) {
  const std::vector<bool> used = used_nodes(nodes, joints);
  std::vector<int> moving_of(nodes.size(), -1);
  std::vector<Eigen::Matrix4d> at_rest(nodes.size(), Eigen::Matrix4d::Identity());  // T_world_node, if it rests
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!used[i]) continue;
    const GraphNode& node = nodes[i];
    const auto parent = static_cast<std::size_t>(node.parent);
    const Eigen::Matrix4d T_world_parent = node.parent >= 0 ? at_rest[parent] : Eigen::Matrix4d::Identity();
    const int moving_parent = node.parent >= 0 ? moving_of[parent] : -1;
    if (moving_parent < 0 && !is_animated(node)) {
      at_rest[i] = T_world_parent * local_transform(node, 0);
      continue;
    }
    moving_of[i] = static_cast<int>(nodes_.size());
    nodes_.push_back({moving_parent, node, T_world_parent});
  }
  for (const Joint& joint : joints) {
    const auto node = static_cast<std::size_t>(joint.node);
    if (joint.node < 0) {
      joints_.push_back({-1, joint.offset});
    } else if (moving_of[node] < 0) {
      joints_.push_back({-1, at_rest[node] * joint.offset});
    } else {
      joints_.push_back({moving_of[node], joint.offset});
    }
  }
}

void JointMotion::evaluate(double t_s, std::vector<JointMatrix>& matrices) const {
  std::vector<MovingTransform> world(nodes_.size());
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const MovingNode& moving = nodes_[i];
    const MovingTransform local = moving_local_transform(moving.node, t_s);
    if (moving.parent < 0) {
      world[i] = {moving.T_world_parent * local.value, moving.T_world_parent * local.slope};
    } else {
      const MovingTransform& parent = world[static_cast<std::size_t>(moving.parent)];
      world[i] = {parent.value * local.value, parent.slope * local.value + parent.value * local.slope};
    }
  }
  matrices.assign(joints_.size(), {});
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const MovingJoint& joint = joints_[i];
    if (joint.node < 0) {
      store(joint.offset, matrices[i].columns);
      continue;
    }
    const MovingTransform& node = world[static_cast<std::size_t>(joint.node)];
    store(node.value * joint.offset, matrices[i].columns);
    store(node.slope * joint.offset, matrices[i].columns + JointMatrix::kSize / 2);
  }
}

}  // namespace esim::inline scene
