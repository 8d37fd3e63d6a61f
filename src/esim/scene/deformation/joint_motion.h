#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "esim/scene/import/scene_graph.h"

namespace esim::inline scene {

/// The transform of a joint and its time derivative (per second) in the layout of the loop over vertices: the four
/// columns of the upper three rows of a matrix, padded by 0 to four numbers each, for the transform, then for the
/// derivative.
struct alignas(32) JointMatrix {
  static constexpr std::size_t kSize = 32;
  float columns[kSize] = {};
};

/// Transforms of a mesh's joints over time.
class JointMotion {
 public:
  /// A transform that follows a node: world(node, t) * offset.
  struct Joint {
    int node = -1;  ///< -1: the world
    Eigen::Matrix4d offset = Eigen::Matrix4d::Identity();
  };

  /// Keeps a copy of the nodes that the joints depend on.
  JointMotion(const std::vector<GraphNode>& nodes, const std::vector<Joint>& joints);

  std::size_t size() const { return joints_.size(); }

  void evaluate(double t_s, std::vector<JointMatrix>& matrices) const;

 private:
  /// A node whose transform in its parent's frame changes, or one of its descendants.
  struct MovingNode {
    int parent = -1;  ///< index of a moving node; -1: at rest
    GraphNode node;
    Eigen::Matrix4d T_world_parent = Eigen::Matrix4d::Identity();  ///< of the resting parent
  };
  struct MovingJoint {
    int node = -1;  ///< index of a moving node; -1: at rest
    Eigen::Matrix4d offset = Eigen::Matrix4d::Identity();
  };

  std::vector<MovingNode> nodes_;
  std::vector<MovingJoint> joints_;
};

}  // namespace esim::inline scene
