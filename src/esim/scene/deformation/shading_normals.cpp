#include "esim/scene/deformation/shading_normals.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "esim/core/fast_arc_tangent.h"

namespace esim::inline scene {
namespace {

constexpr float kHalfTurn = std::numbers::pi_v<float>;
constexpr float kThinnest = 1e-6F;  // area of a triangle that counts, per square of its longest edge

/// The angle of a vector (x, y) with y > 0 to the x axis, in rad; without branches, which would be unpredictable.
float angle_of(float x, float y) {
  const float of_smaller = fast_arc_tangent(std::min(std::abs(x), y) / std::max(std::abs(x), y));
  const float acute = y > std::abs(x) ? kHalfTurn / 2 - of_smaller : of_smaller;
  return x < 0 ? kHalfTurn - acute : acute;
}

/// Adds the normal of each triangle to the sums of its corners' groups.
void add_triangles(const std::vector<std::array<std::uint32_t, 3>>& triangles,
                   const std::vector<std::uint32_t>& group_of, const std::vector<Eigen::Vector3f>& positions,
                   std::vector<Eigen::Vector3f>& sums) {
  for (const auto& triangle : triangles) {
    const Eigen::Vector3f &a = positions[triangle[0]], &b = positions[triangle[1]], &c = positions[triangle[2]];
    const Eigen::Vector3f ab = b - a, bc = c - b, ca = a - c, normal = ab.cross(bc);
    const float area2 = normal.norm();
    const float longest2 = std::max({ab.squaredNorm(), bc.squaredNorm(), ca.squaredNorm()});
    if (!(area2 > 2 * kThinnest * longest2) || !std::isfinite(area2)) continue;
    const float first = angle_of(-ab.dot(ca), area2), second = angle_of(-bc.dot(ab), area2);
    const float angles[] = {first, second, kHalfTurn - first - second};
    const Eigen::Vector3f unit = normal / area2;
    for (std::size_t i = 0; i < 3; ++i) sums[group_of[triangle[i]]] += angles[i] * unit;
  }
}

}  // namespace

ShadingNormals::ShadingNormals(const Mesh& mesh) {
  if (mesh.normals.empty()) return;
  triangles_ = mesh.triangles;
  std::map<std::array<float, 6>, std::uint32_t> groups;
  std::vector<Eigen::Vector3f> rest;  // normals of the groups in the mesh
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3f &p = mesh.vertices[i], &n = mesh.normals[i];
    const auto [group, is_new] =
        groups.try_emplace({p[0], p[1], p[2], n[0], n[1], n[2]}, static_cast<std::uint32_t>(groups.size()));
    if (is_new) rest.push_back(n);
    group_of_.push_back(group->second);
  }
  std::vector<Eigen::Vector3f> sums(rest.size(), Eigen::Vector3f::Zero());
  add_triangles(triangles_, group_of_, mesh.vertices, sums);
  for (std::size_t i = 0; i < rest.size(); ++i)
    sides_.push_back(rest[i].isZero(0) ? 0.0F : std::copysign(1.0F, sums[i].dot(rest[i])));
}

void ShadingNormals::evaluate(const std::vector<Eigen::Vector3f>& positions,
                              std::vector<Eigen::Vector3f>& normals) const {
  thread_local std::vector<Eigen::Vector3f> sums;
  sums.assign(sides_.size(), Eigen::Vector3f::Zero());
  add_triangles(triangles_, group_of_, positions, sums);
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const float length = sums[i].norm();
    sums[i] = length > 0 ? Eigen::Vector3f(sums[i] / length * sides_[i]) : Eigen::Vector3f::Zero();
  }
  normals.resize(group_of_.size());
  for (std::size_t i = 0; i < group_of_.size(); ++i) normals[i] = sums[group_of_[i]];
}

}  // namespace esim::inline scene
