#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <random>
#include <vector>

#include "glb_writer.h"

namespace esim::test {

/// A random figure: a tree of joints with animated transforms, a mesh with normals, influences in several sets, and
/// morph targets of animated weights. shape() evaluates it by the equations of glTF 2.0, one vertex at a time, in
/// double precision.
class SkinnedFigure {
 public:
  struct Joint {
    int parent = -1;
    std::vector<Eigen::Vector3d> translations, scales;  // per key
    std::vector<Eigen::Quaterniond> rotations;
    Eigen::Matrix4d inverse_bind = Eigen::Matrix4d::Identity();
  };
  struct Vertex {
    Eigen::Vector3d position, normal;
    std::vector<std::pair<std::size_t, double>> influences;
    std::vector<Eigen::Vector3d> offsets, normal_offsets;  // per morph target
  };

  static constexpr int kKeys = 5;
  static constexpr double kInterval_s = 0.3;
  std::vector<Joint> joints;
  std::vector<Vertex> vertices;
  std::vector<std::vector<double>> weights;  // of morph targets, per key

  SkinnedFigure(unsigned seed, std::size_t joint_count, std::size_t vertex_count, std::size_t targets,
                std::size_t influences)
      : random_(seed) {
    for (std::size_t j = 0; j < joint_count; ++j) {
      Joint joint;
      joint.parent = j == 0 ? -1 : static_cast<int>(random_() % j);
      for (int k = 0; k < kKeys; ++k) {
        joint.translations.push_back(vector(0.3F));
        joint.scales.emplace_back(Eigen::Vector3d::Ones() + vector(0.2F));
        Eigen::Quaterniond q(number(1), number(1), number(1), number(1));
        joint.rotations.push_back(single(q.normalized()));
      }
      joint.inverse_bind = random_affine();
      joints.push_back(joint);
    }
    for (std::size_t v = 0; v < vertex_count; ++v) {
      Vertex vertex{vector(1), single(vector(1).normalized()), {}, {}, {}};
      std::vector<double> parts;
      double sum = 0;
      for (std::size_t i = 0; i < influences; ++i) sum += parts.emplace_back(1.1 + number(1));
      for (const double part : parts) vertex.influences.emplace_back(random_() % joint_count, float(part / sum));
      for (std::size_t t = 0; t < targets; ++t) {
        vertex.offsets.push_back(v % 3 == t % 3 ? Eigen::Vector3d::Zero().eval() : vector(0.2F));
        vertex.normal_offsets.push_back(vector(0.1F));
      }
      vertices.push_back(vertex);
    }
    for (int k = 0; k < kKeys && targets > 0; ++k) {
      weights.emplace_back();
      for (std::size_t t = 0; t < targets; ++t) weights.back().push_back(number(1));
    }
  }

  struct Shape {
    std::vector<Eigen::Vector3d> positions, normals;
  };

  /// The figure at a time in the glTF file's coordinates, with linear keys.
  Shape shape(double t_s) const {
    const double place = std::clamp(t_s / kInterval_s, 0.0, kKeys - 1.0);
    const auto k = std::min(static_cast<std::size_t>(place), static_cast<std::size_t>(kKeys - 2));
    const double s = place - static_cast<double>(k);
    std::vector<Eigen::Matrix4d> world;
    for (const Joint& joint : joints) {
      Eigen::Affine3d local = Eigen::Translation3d((1 - s) * joint.translations[k] + s * joint.translations[k + 1]) *
                              joint.rotations[k].slerp(s, joint.rotations[k + 1]) *
                              Eigen::Scaling(((1 - s) * joint.scales[k] + s * joint.scales[k + 1]).eval());
      world.emplace_back(joint.parent < 0 ? local.matrix()
                                          : world[static_cast<std::size_t>(joint.parent)] * local.matrix());
    }
    Shape result;
    for (const Vertex& vertex : vertices) {
      Eigen::Vector3d position = vertex.position, normal = vertex.normal;
      for (std::size_t t = 0; t < vertex.offsets.size(); ++t) {
        const double weight = (1 - s) * weights[k][t] + s * weights[k + 1][t];
        position += weight * vertex.offsets[t], normal += weight * vertex.normal_offsets[t];
      }
      Eigen::Matrix4d blended = Eigen::Matrix4d::Zero();
      for (const auto& [joint, weight] : vertex.influences)
        blended += weight * world[joint] * joints[joint].inverse_bind;
      result.positions.emplace_back((blended * position.homogeneous()).head<3>());
      result.normals.emplace_back((blended.topLeftCorner<3, 3>().inverse().transpose() * normal).normalized());
    }
    return result;
  }

  /// The file. Its mesh has one triangle per three vertices.
  GlbWriter glb() const {
    GlbWriter glb;
    std::vector<std::size_t> nodes;
    nlohmann::json skin;
    std::vector<float> times, inverse_binds;
    for (int k = 0; k < kKeys; ++k) times.push_back(static_cast<float>(k * kInterval_s));
    for (const Joint& joint : joints) {
      nodes.push_back(joint.parent < 0 ? glb.add_node({{"name", "joint"}}) : glb.add("nodes", {{"name", "joint"}}));
      if (joint.parent >= 0)
        glb.json["nodes"][nodes[static_cast<std::size_t>(joint.parent)]]["children"].push_back(nodes.back());
      skin["joints"].push_back(nodes.back());
      for (const double x : joint.inverse_bind.reshaped()) inverse_binds.push_back(static_cast<float>(x));
      std::vector<float> rotations;
      for (const auto& q : joint.rotations)
        for (const double x : q.coeffs()) rotations.push_back(static_cast<float>(x));
      glb.animate(nodes.back(), "translation", times, flat(joint.translations));
      glb.animate(nodes.back(), "rotation", times, rotations);
      glb.animate(nodes.back(), "scale", times, flat(joint.scales));
    }
    skin["inverseBindMatrices"] = glb.floats(inverse_binds, "MAT4");
    const std::size_t figure =
        glb.add_node({{"name", "figure"}, {"mesh", 0}, {"skin", glb.add("skins", skin)}, {"translation", {5, 6, 7}}});
    glb.add("meshes", {{"name", "figure"}, {"primitives", {primitive(glb)}}});
    if (weights.empty()) return glb;
    std::vector<float> of_targets;
    for (const auto& key : weights) of_targets.insert(of_targets.end(), key.begin(), key.end());
    glb.animate(figure, "weights", times, of_targets);
    return glb;
  }

 private:
  nlohmann::json primitive(GlbWriter& glb) const {
    std::vector<Eigen::Vector3d> positions, normals;
    std::vector<std::uint16_t> indices;
    for (const Vertex& vertex : vertices) {
      indices.push_back(static_cast<std::uint16_t>(positions.size()));
      positions.push_back(vertex.position), normals.push_back(vertex.normal);
    }
    nlohmann::json attributes = {{"POSITION", glb.floats(flat(positions), "VEC3")},
                                 {"NORMAL", glb.floats(flat(normals), "VEC3")}};
    for (std::size_t set = 0; 4 * set < vertices[0].influences.size(); ++set) {
      std::vector<std::uint8_t> of_joints;
      std::vector<float> of_weights;
      for (const Vertex& vertex : vertices) {
        for (std::size_t i = 4 * set; i < 4 * set + 4; ++i) {
          const bool there = i < vertex.influences.size();
          of_joints.push_back(there ? static_cast<std::uint8_t>(vertex.influences[i].first) : 0);
          of_weights.push_back(there ? static_cast<float>(vertex.influences[i].second) : 0);
        }
      }
      attributes["JOINTS_" + std::to_string(set)] = glb.joints(of_joints);
      attributes["WEIGHTS_" + std::to_string(set)] = glb.floats(of_weights, "VEC4");
    }
    nlohmann::json result = {{"attributes", attributes}, {"indices", glb.indices(indices)}};
    for (std::size_t t = 0; t < vertices[0].offsets.size(); ++t) {
      std::vector<std::uint16_t> places;
      std::vector<Eigen::Vector3d> offsets, of_normals;
      for (std::size_t v = 0; v < vertices.size(); ++v) {
        of_normals.push_back(vertices[v].normal_offsets[t]);
        if (vertices[v].offsets[t].isZero()) continue;
        places.push_back(static_cast<std::uint16_t>(v)), offsets.push_back(vertices[v].offsets[t]);
      }
      const std::size_t position = glb.sparse(vertices.size(), places, flat(offsets));
      result["targets"].push_back({{"POSITION", position}, {"NORMAL", glb.floats(flat(of_normals), "VEC3")}});
    }
    return result;
  }

  static std::vector<float> flat(const std::vector<Eigen::Vector3d>& vectors) {
    std::vector<float> result;
    for (const Eigen::Vector3d& v : vectors)
      for (const double x : v) result.push_back(static_cast<float>(x));
    return result;
  }

  // Numbers that single precision stores exactly.
  double number(float scale) {
    return static_cast<double>(scale * std::uniform_real_distribution<float>(-1, 1)(random_));
  }
  Eigen::Vector3d vector(float scale) { return {number(scale), number(scale), number(scale)}; }
  static Eigen::Vector3d single(const Eigen::Vector3d& v) { return v.cast<float>().cast<double>(); }
  static Eigen::Quaterniond single(const Eigen::Quaterniond& q) { return q.cast<float>().cast<double>(); }
  Eigen::Matrix4d random_affine() {
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    for (Eigen::Index i = 0; i < 12; ++i) matrix(i % 3, i / 3) += number(0.3F);
    return matrix;
  }

  std::mt19937 random_;
};

}  // namespace esim::test
