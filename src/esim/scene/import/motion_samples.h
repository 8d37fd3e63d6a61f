#pragma once

#include <vector>

#include "esim/scene/import/scene_graph.h"
#include "esim/scene/scene_file.h"

namespace esim {

/// Where the nodes of a graph are over time.
class NodeTransforms {
 public:
  /// Throws UserError for nodes nested deeper than anybody would.
  NodeTransforms(const SceneGraph& graph, const std::filesystem::path& file);

  /// From the node's frame to the world's.
  Eigen::Matrix4d world(std::size_t node, double t_s) const;

  /// Whether the node moves in its parent's frame.
  bool is_animated(std::size_t node) const { return animated_[node]; }

  /// From the first to the last key of whatever is animated; both 0 where nothing is.
  double start_s() const { return start_s_; }
  double end_s() const { return end_s_; }
  TimeSpan span() const { return {to_ns(start_s_), to_ns(end_s_)}; }

  /// The nodes on which a node's place in the world depends: itself, its parent, ...
  std::vector<std::size_t> chain(std::size_t node) const;

  const GraphNode& node(std::size_t index) const { return graph_.nodes[index]; }

 private:
  const SceneGraph& graph_;
  std::vector<bool> animated_;
  double start_s_ = 0, end_s_ = 0;
};

/// The motion of a frame attached to a node, over the whole of the graph's animation. Keys that are close together, as
/// baked animations have them, are samples of a smooth motion, and are taken as they are; between others the file's
/// interpolation is followed densely. Warns where the motion is not rigid.
SceneMotion sample_motion(const NodeTransforms& transforms, std::size_t node, const Eigen::Matrix4d& T_node_frame,
                          const std::string& name, const WarningHandler& warn);

}  // namespace esim
