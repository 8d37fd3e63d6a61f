#include "esim/scene/import/gltf/gltf_shapes.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>

namespace esim::inline scene {
namespace {

constexpr std::size_t kMaxSets = 16;

/// The joints of vertices, normalised. Faults are counted, for one warning each.
class InfluenceList {
 public:
  explicit InfluenceList(SkinWeights& skin) : skin_(skin) {}

  void add(std::uint32_t joint, float weight) {
    if (weight < 0) ++negative_;
    if (!(weight > 0)) return;
    skin_.influences.push_back({joint, weight});
    sum_ += double{weight};
  }

  /// Normalises the weights of the vertex whose influences were added. Four weights of 8 bits have a sum within 4/510
  /// of 1.
  void finish_vertex() {
    constexpr double kRounding = 0.01;
    if (!(sum_ > 0)) {
      ++without_;
      skin_.influences.push_back({0, 1});
    } else {
      if (std::abs(sum_ - 1) > kRounding) ++unnormalised_;
      for (std::size_t i = skin_.begin_of(skin_.ends.size()); i < skin_.influences.size(); ++i) {
        float& weight = skin_.influences[i].weight;
        weight = static_cast<float>(double{weight} / sum_);
      }
    }
    skin_.ends.push_back(static_cast<std::uint32_t>(skin_.influences.size()));
    sum_ = 0;
  }

  void warn(const std::string& name, std::vector<std::string>& warnings) const {
    if (negative_ > 0)
      warnings.push_back(
          fmt::format("mesh {}: {} weights of joints are negative, and are taken as 0", name, negative_));
    if (unnormalised_ > 0)
      warnings.push_back(
          fmt::format("mesh {}: the weights of the joints of {} vertices do not have the sum 1, and are normalised",
                      name, unnormalised_));
    if (without_ > 0)
      warnings.push_back(
          fmt::format("mesh {}: {} vertices have no joint, and follow the first joint of the skin", name, without_));
  }

 private:
  SkinWeights& skin_;
  double sum_ = 0;
  std::size_t negative_ = 0, unnormalised_ = 0, without_ = 0;
};

Eigen::Vector3f vector_at(const std::vector<float>& values, std::size_t i) {
  return {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
}

}  // namespace

void GltfShapes::append(const Json& primitive, const Range& range, const std::string& name, GraphShape& shape) {
  const Json* const targets = GltfDocument::find(primitive, "targets");
  if (targets != nullptr && targets->is_array() && !targets->empty()) append_targets(*targets, range, name, shape);
  const Json& attributes = primitive["attributes"];
  if (GltfDocument::find(attributes, "JOINTS_0") != nullptr || !shape.skin.ends.empty())
    append_influences(attributes, range, name, shape);
}

void GltfShapes::append_targets(const Json& targets, const Range& range, const std::string& name, GraphShape& shape) {
  if (!shape.targets.empty() && shape.targets.size() != targets.size())
    document_.fail(fmt::format("is damaged: the primitives of mesh {} have {} and {} morph targets", name,
                               shape.targets.size(), targets.size()));
  morph_count_ += targets.size() * range.count;
  if (morph_count_ > kMaxSceneMorphs)
    document_.fail(fmt::format("has morph targets of more than {} vertices in total; export fewer", kMaxSceneMorphs));
  for (std::size_t i = 0; i < targets.size(); ++i) {
    MorphTarget read = target(targets[i], range);
    if (i >= shape.targets.size()) {
      shape.targets.push_back(std::make_shared<const MorphTarget>(std::move(read)));
      continue;
    }
    MorphTarget joined = *shape.targets[i];
    joined.normals.resize(joined.vertices.size(), Eigen::Vector3f::Zero());
    joined.vertices.insert(joined.vertices.end(), read.vertices.begin(), read.vertices.end());
    joined.positions.insert(joined.positions.end(), read.positions.begin(), read.positions.end());
    joined.normals.insert(joined.normals.end(), read.normals.begin(), read.normals.end());
    shape.targets[i] = std::make_shared<const MorphTarget>(std::move(joined));
  }
}

MorphTarget GltfShapes::target(const Json& json, const Range& range) const {
  const auto offsets = [&](const char* attribute) {
    std::vector<float> values;
    if (GltfDocument::find(json, attribute) == nullptr) return values;
    values = document_.floats(document_.index(json, attribute, "accessors"), 3);
    if (values.size() != 3 * range.count)
      document_.fail(fmt::format("is damaged: a morph target has {} offsets for a primitive of {} vertices",
                                 values.size() / 3, range.count));
    return values;
  };
  const std::vector<float> positions = offsets("POSITION");
  const std::vector<float> normals = range.has_normals ? offsets("NORMAL") : std::vector<float>{};
  MorphTarget target;
  for (std::size_t i = 0; i < range.count; ++i) {
    const Eigen::Vector3f position = positions.empty() ? Eigen::Vector3f::Zero() : vector_at(positions, i);
    const Eigen::Vector3f normal = normals.empty() ? Eigen::Vector3f::Zero() : vector_at(normals, i);
    if (position.isZero(0) && normal.isZero(0)) continue;
    target.vertices.push_back(static_cast<std::uint32_t>(range.first + i));
    target.positions.push_back(position);
    target.normals.push_back(normal);
  }
  return target;
}

void GltfShapes::append_influences(const Json& attributes, const Range& range, const std::string& name,
                                   GraphShape& shape) const {
  struct Set {
    std::vector<std::uint32_t> joints;
    std::vector<float> weights;
  };
  std::vector<Set> sets;
  for (;;) {
    const std::string joints = fmt::format("JOINTS_{}", sets.size()), weights = fmt::format("WEIGHTS_{}", sets.size());
    if (GltfDocument::find(attributes, joints.c_str()) == nullptr) break;
    if (sets.size() == kMaxSets) {
      warnings_.push_back(fmt::format("mesh {}: only the first {} joints per vertex are used", name, 4 * kMaxSets));
      break;
    }
    sets.push_back({document_.integers(document_.index(attributes, joints.c_str(), "accessors"), 4),
                    document_.floats(document_.index(attributes, weights.c_str(), "accessors"), 4)});
    if (sets.back().joints.size() != 4 * range.count || sets.back().weights.size() != 4 * range.count)
      document_.fail(fmt::format("is damaged: mesh {} must have four joints and weights per vertex", name));
  }
  InfluenceList influences(shape.skin);
  while (shape.skin.ends.size() < range.first) influences.finish_vertex();  // earlier primitives without joints
  for (std::size_t i = 0; i < range.count; ++i) {
    for (const Set& set : sets) {
      for (std::size_t c = 0; c < 4; ++c) influences.add(set.joints[4 * i + c], set.weights[4 * i + c]);
    }
    influences.finish_vertex();
  }
  influences.warn(name, warnings_);
}

void GltfShapes::finish(const Json& mesh, GraphShape& shape) const {
  if (shape.targets.empty()) return;
  const auto weights = document_.numbers(mesh, "weights", std::vector<double>(shape.targets.size()));
  shape.weights.assign(weights.begin(), weights.end());
}

GraphSkin GltfShapes::skin(std::size_t index, const std::vector<int>& node_of) const {
  const Json& json = document_.list("skins")[index];
  GraphSkin skin;
  skin.name = document_.text(json, "name", fmt::format("skin {}", index));
  const Json* const joints = GltfDocument::find(json, "joints");
  if (joints == nullptr || !joints->is_array() || joints->empty())
    document_.fail(fmt::format("is damaged: {} has no joints", skin.name));
  for (const Json& joint : *joints) {
    if (!joint.is_number_unsigned() || joint.get<std::uint64_t>() >= node_of.size() ||
        node_of[joint.get<std::size_t>()] < 0)
      document_.fail(fmt::format("is damaged: a joint of {} is not a node of the scene", skin.name));
    skin.joints.push_back(static_cast<std::uint32_t>(node_of[joint.get<std::size_t>()]));
  }
  skin.inverse_bind.assign(skin.joints.size(), Eigen::Matrix4d::Identity());
  if (GltfDocument::find(json, "inverseBindMatrices") == nullptr) return skin;

  const auto columns = document_.floats(document_.index(json, "inverseBindMatrices", "accessors"), 16);
  if (columns.size() < 16 * skin.joints.size())
    document_.fail(fmt::format("is damaged: {} has {} joints, but {} inverse bind matrices", skin.name,
                               skin.joints.size(), columns.size() / 16));
  std::size_t singular = 0;
  for (std::size_t i = 0; i < skin.joints.size(); ++i) {
    Eigen::Matrix4d& matrix = skin.inverse_bind[i];
    matrix = Eigen::Map<const Eigen::Matrix4f>(&columns[16 * i]).cast<double>();
    constexpr double kRounding = 1e-3;
    if ((matrix.row(3) - Eigen::RowVector4d::UnitW()).norm() > kRounding)
      document_.fail(fmt::format("is damaged: an inverse bind matrix of {} is not affine", skin.name));
    matrix.row(3) = Eigen::RowVector4d::UnitW();
    const double volume = matrix.col(0).norm() * matrix.col(1).norm() * matrix.col(2).norm();
    constexpr double kFlat = 1e-9;
    if (!(std::abs(matrix.topLeftCorner<3, 3>().determinant()) > kFlat * volume)) ++singular;
  }
  if (singular > 0)
    warnings_.push_back(
        fmt::format("{}: {} inverse bind matrices are singular, and are used as they are: what follows these joints is "
                    "flat",
                    skin.name, singular));
  return skin;
}

void GltfShapes::check(const SceneGraph& graph) const {
  for (const GraphNode& node : graph.nodes) {
    if (node.skin < 0) continue;
    const std::size_t joints = graph.skins[static_cast<std::size_t>(node.skin)].joints.size();
    for (const std::uint32_t mesh : node.meshes) {
      const SkinWeights& weights = graph.shapes[mesh].skin;
      if (weights.ends.empty())
        warnings_.push_back(fmt::format("object {}: has a skin, but its mesh has no joints; it is rigid", node.name));
      for (const auto& [joint, weight] : weights.influences) {
        if (joint >= joints)
          document_.fail(fmt::format("is damaged: object {} refers to joint {} of {}", node.name, joint, joints));
      }
    }
  }
}

}  // namespace esim::inline scene
