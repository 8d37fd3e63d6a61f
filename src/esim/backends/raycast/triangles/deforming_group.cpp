#include "esim/backends/raycast/triangles/deforming_group.h"

#include <algorithm>
#include <cstdlib>

namespace esim::inline backends::inline raycast {
namespace {

constexpr std::size_t kKept = 4;            // objects that no request uses
constexpr int kProbes = 16;                 // times at which trees are compared
constexpr TimeNs kProbed = 60'000'000'000;  // the time from the beginning in which they are: animations may repeat
constexpr double kMuchSlower = 1.5;         // cost of a tree in proportion to that of a new one
constexpr std::size_t kNoBranches = ~0U;    // of an object without a tree

}  // namespace

DeformingGroup::DeformingGroup(const SceneObject& object, const TriangleUse& use, std::uint32_t first_material)
    : deformation_(object.deformation),
      use_(use),
      corners_(object.mesh.triangles),
      first_vertices_(object.mesh.vertices) {
  shading_.reserve(corners_.size());
  for (std::size_t i = 0; i < corners_.size(); ++i) shading_.emplace_back(object.mesh, i, first_material);
  if (use_.surfaces) connect(object.mesh, use_.normals, shading_);
  if (use_.wants_tree(corners_.size())) plant_trees();
}

/// Builds a tree for the beginning, and another one wherever the previous tree has become much slower than a new one.
void DeformingGroup::plant_trees() {
  TimeSpan span = deformation_->span();
  span.end = std::min(span.end, span.start + kProbed);
  DeformedVertices vertices;
  TriangleTree refitted;
  for (int probe = 0; probe <= kProbes; ++probe) {
    const TimeNs t = span.start + (span.end - span.start) / kProbes * probe;
    deformation_->evaluate(t, vertices);
    if (!trees_.empty()) {
      refitted = trees_.back().tree;
      refitted.refit(vertices.positions, corners_);
    }
    TriangleTree fresh(vertices.positions, corners_);
    if (trees_.empty() || refitted.cost() > kMuchSlower * fresh.cost()) trees_.push_back({t, std::move(fresh)});
  }
}

std::size_t DeformingGroup::branches_at(TimeNs t) const {
  if (trees_.empty()) return kNoBranches;
  const auto nearest = std::min_element(trees_.begin(), trees_.end(), [t](const Tree& a, const Tree& b) {
    return std::abs(a.t - t) < std::abs(b.t - t);
  });
  return static_cast<std::size_t>(nearest - trees_.begin());
}

std::shared_ptr<const DeformedGroup> DeformingGroup::at(TimeNs t) const {
  std::shared_ptr<DeformedGroup> group = find(t);
  if (group->t == t && !group->vertices.positions.empty()) return group;
  deform(t, *group);
  const std::lock_guard lock(mutex_);
  recent_.push_back(group);
  return group;
}

/// The object at that time, if it is known, or memory for it.
std::shared_ptr<DeformedGroup> DeformingGroup::find(TimeNs t) const {
  const std::lock_guard lock(mutex_);
  const auto is_wanted = [t](const auto& group) { return group->t == t; };
  if (const auto known = std::find_if(recent_.begin(), recent_.end(), is_wanted); known != recent_.end()) {
    std::rotate(known, known + 1, recent_.end());  // the most recent one is the last
    return recent_.back();
  }
  const auto is_unused = [](const auto& group) { return group.use_count() == 1; };
  auto unused = static_cast<std::size_t>(std::count_if(recent_.begin(), recent_.end(), is_unused));
  std::shared_ptr<DeformedGroup> memory;
  for (; unused >= kKept; --unused) {
    const auto oldest = std::find_if(recent_.begin(), recent_.end(), is_unused);
    memory = std::move(*oldest);
    recent_.erase(oldest);
  }
  return memory != nullptr ? memory : std::make_shared<DeformedGroup>();
}

void DeformingGroup::deform(TimeNs t, DeformedGroup& group) const {
  deformation_->evaluate(t, group.vertices);
  const std::vector<Eigen::Vector3f>& positions = group.vertices.positions;
  if (const std::size_t branches = branches_at(t); branches != kNoBranches) {
    if (group.triangles.tree.empty() || group.branches != branches) group.triangles.tree = trees_[branches].tree;
    group.branches = branches;
    group.triangles.tree.refit(positions, corners_);
  }
  if (use_.rays) {
    // Its hierarchy is always that of the first shape, whatever was in this memory before.
    if (group.triangles.rays.scene() == nullptr)
      group.triangles.rays = RayTriangles(use_.device, first_vertices_, corners_, true);
    group.triangles.rays.refit(positions);
  }
  group.t = t;
}

}  // namespace esim::inline backends::inline raycast
