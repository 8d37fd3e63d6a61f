#pragma once

#include <filesystem>
#include <memory>

#include "esim/scene/deformation/skinned_deformation.h"
#include "esim/scene/import/motion_samples.h"
#include "esim/scene/import/scene_graph.h"

namespace esim::inline scene {

/// A part of a graph: one of the meshes of a node.
struct GraphPart {
  std::size_t node = 0;
  std::uint32_t mesh = 0;
};

/// Whether joints place the part, so that its node does not.
bool is_skinned(const SceneGraph& graph, const GraphPart& part);

/// Whether the part changes its shape over time, in the frame of its node, or in the world's if it is skinned.
bool deforms(const SceneGraph& graph, const NodeTransforms& transforms, const GraphPart& part);

/// Joins parts of a graph to one mesh that deforms.
class DeformingMesh {
 public:
  DeformingMesh(const SceneGraph& graph, const NodeTransforms& transforms, const std::filesystem::path& file)
      : graph_(graph), transforms_(transforms), file_(file) {}

  /// Adds a part, which follows its joints or, without these, its node. The frame is the world's.
  void append(const GraphPart& part);

  /// Adds a part without joints, at a constant transform.
  void append_at(const GraphPart& part, const Eigen::Matrix4d& T_object_node);

  bool empty() const { return mesh_.triangles.empty(); }

  /// The mesh at the start of the animation, without materials, and its deformation. Throws UserError if vertices are
  /// not finite.
  Mesh take(std::shared_ptr<const Deformation>& deformation);

 private:
  void append_geometry(const Mesh& mesh);
  void append_morphs(const GraphNode& node, const GraphShape& shape, std::size_t first_vertex);
  void append_following(const GraphPart& part, const JointMotion::Joint& joint);
  void follow_skin(const GraphSkin& skin, const SkinWeights& weights);

  const SceneGraph& graph_;
  const NodeTransforms& transforms_;
  const std::filesystem::path& file_;
  Mesh mesh_;
  RestShape rest_;
  SkinWeights weights_;
  std::vector<Morph> morphs_;
  std::vector<JointMotion::Joint> joints_;
  bool any_normals_ = false;
};

/// A part as it is at the start of the animation, in the frame of its node, or in the world's if it is skinned.
Mesh shaped_at_start(const SceneGraph& graph, const NodeTransforms& transforms, const std::filesystem::path& file,
                     const GraphPart& part);

}  // namespace esim::inline scene
