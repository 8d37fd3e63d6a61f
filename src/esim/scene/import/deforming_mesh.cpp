#include "esim/scene/import/deforming_mesh.h"

#include <algorithm>
#include <cmath>

namespace esim::inline scene {
namespace {

const GraphShape& shape_of(const SceneGraph& graph, std::uint32_t mesh) {
  static const GraphShape kRigid;
  return mesh < graph.shapes.size() ? graph.shapes[mesh] : kRigid;
}

/// Throws UserError if the deformation is not finite at one of some times, as with damaged numbers.
void check_finite(const Deformation& deformation, const std::filesystem::path& file) {
  constexpr TimeNs kLooks = 16;
  const TimeSpan span = deformation.span();
  const auto finite = [](const std::vector<Eigen::Vector3f>& values) {
    return std::all_of(values.begin(), values.end(), [](const Eigen::Vector3f& value) { return value.allFinite(); });
  };
  DeformedVertices vertices;
  for (TimeNs i = 0; i < kLooks; ++i) {
    deformation.evaluate(span.start + (span.end - span.start) / (kLooks - 1) * i, vertices);
    if (!finite(vertices.positions) || !finite(vertices.velocities))
      fail_scene(file, "a vertex is not finite where its animation puts it");
    if (span.end == span.start) return;
  }
}

}  // namespace

bool is_skinned(const SceneGraph& graph, const GraphPart& part) {
  return graph.nodes[part.node].skin >= 0 && !shape_of(graph, part.mesh).skin.ends.empty();
}

bool deforms(const SceneGraph& graph, const NodeTransforms& transforms, const GraphPart& part) {
  if (transforms.morphs(part.node) && !shape_of(graph, part.mesh).targets.empty()) return true;
  if (!is_skinned(graph, part)) return false;
  const std::vector<std::uint32_t>& joints = graph.skins[static_cast<std::size_t>(graph.nodes[part.node].skin)].joints;
  return std::any_of(joints.begin(), joints.end(), [&](std::uint32_t joint) { return transforms.moves(joint); });
}

void DeformingMesh::append_geometry(const Mesh& part) {
  const auto first = static_cast<std::uint32_t>(rest_.vertices.size());
  rest_.vertices.insert(rest_.vertices.end(), part.vertices.begin(), part.vertices.end());
  for (std::size_t i = 0; i < part.vertices.size(); ++i) {
    const Eigen::Vector3f normal = part.normals.empty() ? Eigen::Vector3f::Zero() : part.normals[i];
    const float length = normal.norm();
    const bool usable = length > 1e-12F && std::isfinite(length);
    rest_.normals.push_back(usable ? Eigen::Vector3f(normal / length) : Eigen::Vector3f::Zero());
    any_normals_ |= usable;
  }
  for (const auto& triangle : part.triangles)
    mesh_.triangles.push_back({first + triangle[0], first + triangle[1], first + triangle[2]});
  mesh_.texture_uv.insert(mesh_.texture_uv.end(), part.texture_uv.begin(), part.texture_uv.end());
  mesh_.material.insert(mesh_.material.end(), part.material.begin(), part.material.end());
}

void DeformingMesh::append_morphs(const GraphNode& node, const GraphShape& shape, std::size_t first_vertex) {
  if (shape.targets.empty()) return;
  const bool varying = varies(node.weight_track, shape.targets.size());
  morphs_.push_back({first_vertex, shape.targets, node.weights.empty() ? shape.weights : node.weights, {}});
  Morph& morph = morphs_.back();
  if (varying) morph.track = node.weight_track;
  if (varying || node.weight_track.times_s.empty()) return;
  std::vector<float> slopes;
  sample_at(node.weight_track, 0, shape.targets.size(), morph.weights, slopes);
}

void DeformingMesh::append_following(const GraphPart& part, const JointMotion::Joint& joint) {
  const Mesh& mesh = graph_.meshes[part.mesh];
  append_morphs(graph_.nodes[part.node], shape_of(graph_, part.mesh), rest_.vertices.size());
  append_geometry(mesh);
  const auto index = static_cast<std::uint32_t>(joints_.size());
  joints_.push_back(joint);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    weights_.influences.push_back({index, 1});
    weights_.ends.push_back(static_cast<std::uint32_t>(weights_.influences.size()));
  }
}

void DeformingMesh::follow_skin(const GraphSkin& skin, const SkinWeights& weights) {
  const auto first_joint = static_cast<std::uint32_t>(joints_.size());
  const auto first = static_cast<std::uint32_t>(weights_.influences.size());
  for (std::size_t i = 0; i < skin.joints.size(); ++i)
    joints_.push_back({static_cast<int>(skin.joints[i]), skin.inverse_bind[i]});
  for (const auto& [joint, weight] : weights.influences) weights_.influences.push_back({first_joint + joint, weight});
  for (const std::uint32_t end : weights.ends) weights_.ends.push_back(first + end);
}

void DeformingMesh::append(const GraphPart& part) {
  if (!is_skinned(graph_, part))
    return append_following(part, {static_cast<int>(part.node), Eigen::Matrix4d::Identity()});
  const GraphNode& node = graph_.nodes[part.node];
  const GraphShape& shape = shape_of(graph_, part.mesh);
  append_morphs(node, shape, rest_.vertices.size());
  append_geometry(graph_.meshes[part.mesh]);
  follow_skin(graph_.skins[static_cast<std::size_t>(node.skin)], shape.skin);
}

void DeformingMesh::append_at(const GraphPart& part, const Eigen::Matrix4d& T_object_node) {
  append_following(part, {-1, T_object_node});
}

Mesh DeformingMesh::take(std::shared_ptr<const Deformation>& deformation) {
  if (!any_normals_) rest_.normals.clear();
  deformation = std::make_shared<const SkinnedDeformation>(std::move(rest_), std::move(weights_), std::move(morphs_),
                                                           JointMotion(graph_.nodes, joints_), transforms_.span());
  check_finite(*deformation, file_);
  DeformedVertices start;
  deformation->evaluate(transforms_.span().start, start);
  mesh_.vertices = std::move(start.positions);
  mesh_.normals = std::move(start.normals);
  return std::move(mesh_);
}

Mesh shaped_at_start(const SceneGraph& graph, const NodeTransforms& transforms, const std::filesystem::path& file,
                     const GraphPart& part) {
  const bool skinned = is_skinned(graph, part);
  if (!skinned && shape_of(graph, part.mesh).targets.empty()) return graph.meshes[part.mesh];
  DeformingMesh mesh(graph, transforms, file);
  if (skinned) {
    mesh.append(part);
  } else {
    mesh.append_at(part, Eigen::Matrix4d::Identity());
  }
  std::shared_ptr<const Deformation> unused;
  return mesh.take(unused);
}

}  // namespace esim::inline scene
