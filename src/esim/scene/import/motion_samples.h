#pragma once

#include <vector>

#include "esim/scene/import/scene_graph.h"
#include "esim/scene/scene_file.h"

namespace esim::inline scene {

/// The poses of a graph's nodes over time.
class NodeTransforms {
 public:
  /// Throws UserError if nodes are nested too deeply.
  NodeTransforms(const SceneGraph& graph, const std::filesystem::path& file);

  /// The transform from the node's frame to the world's.
  Eigen::Matrix4d world(std::size_t node, double t_s) const;

  /// Whether the node moves in its parent's frame.
  bool is_animated(std::size_t node) const { return animated_[node]; }

  /// Whether the node moves in the world.
  bool moves(std::size_t node) const;

  /// Whether the weights of the node's morph targets change.
  bool morphs(std::size_t node) const { return morphs_[node]; }

  /// The times of the first and the last key of all animations; both are 0 if nothing is animated.
  double start_s() const { return start_s_; }
  double end_s() const { return end_s_; }
  TimeSpan span() const { return {to_ns(start_s_), to_ns(end_s_)}; }

  /// The nodes on which a node's pose in the world depends: itself, its parent, ...
  std::vector<std::size_t> chain(std::size_t node) const;

  const GraphNode& node(std::size_t index) const { return graph_.nodes[index]; }

 private:
  const SceneGraph& graph_;
  void add_keys(const std::vector<double>& times_s);

  std::vector<bool> animated_, morphs_;
  bool any_keys_ = false;
  double start_s_ = 0, end_s_ = 0;
};

/// The motion of a frame attached to a node.
struct SampledMotion {
  SceneMotion motion;
  bool rigid = true;  ///< otherwise its scale changes, or it is sheared, which the motion lacks
};

/// The motion over the complete animation of the graph. Keys that are close together, as in baked animations, are
/// samples of a smooth motion and are used directly; between other keys, the file's interpolation is sampled densely.
SampledMotion sample_motion(const NodeTransforms& transforms, std::size_t node, const Eigen::Matrix4d& T_node_frame);

}  // namespace esim::inline scene
