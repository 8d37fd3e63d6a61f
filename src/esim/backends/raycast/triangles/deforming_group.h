#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <mutex>
#include <vector>

#include "esim/backends/raycast/triangles/scene_triangles.h"
#include "esim/render/surface_point.h"
#include "esim/scene/scene.h"

// Private to backends/raycast.
namespace esim::inline backends::inline raycast {

/// A deforming object at one time.
struct DeformedGroup {
  TimeNs t = 0;
  std::size_t branches = 0;  ///< index of the tree whose branches its tree has
  DeformedVertices vertices;
  GroupTriangles triangles;
};

/// The triangles of a deforming object at any time. Any number of threads may use it.
class DeformingGroup {
 public:
  /// `first_material`: of the object's mesh.
  DeformingGroup(const SceneObject& object, const TriangleUse& use, std::uint32_t first_material);

  std::size_t triangle_count() const { return corners_.size(); }

  /// Velocity of a point relative to the object's frame, m/s.
  Eigen::Vector3f velocity(const DeformedGroup& at, const SurfacePoint& point) const {
    return at_point(at.vertices.velocities, corners_[point.triangle], point);
  }

  /// Contains the object at a time.
  Eigen::AlignedBox3f bounds(TimeNs t) const { return deformation_->bounds(t); }

  /// Sets the data of its triangles, from `first` on, to those of the object at one time, which must remain.
  void describe(const DeformedGroup& at, std::uint32_t first, SceneTriangles& triangles) const {
    const bool flat = !use_.normals || at.vertices.normals.empty();
    triangles.set(first, shading_, corners_, at.vertices.positions.data(), flat ? nullptr : at.vertices.normals.data());
  }

  /// The object at a time. Objects of the last few times are kept, and the memory of those before is used again.
  std::shared_ptr<const DeformedGroup> at(TimeNs t) const;

 private:
  void plant_trees();
  std::size_t branches_at(TimeNs t) const;
  std::shared_ptr<DeformedGroup> find(TimeNs t) const;
  void deform(TimeNs t, DeformedGroup& group) const;

  std::shared_ptr<const Deformation> deformation_;
  TriangleUse use_;
  std::vector<Corners> corners_;
  std::vector<TriangleShading> shading_;  // with the gradients of the first shape

  // A tree that is refitted far from the shape for which it was built is slow, so that there are several; each is used
  // at the times that are nearest to its own.
  struct Tree {
    TimeNs t;
    TriangleTree tree;
  };
  std::vector<Tree> trees_;
  std::vector<Eigen::Vector3f> first_vertices_;

  mutable std::mutex mutex_;  // of those that follow
  mutable std::vector<std::shared_ptr<DeformedGroup>> recent_;
};

/// A deforming object at the time of a request, which is computed when it is first needed: most tiles do not see it.
class DeformsLater {
 public:
  /// `triangles`: of that time, which receive the object's data. Both must outlive it.
  DeformsLater(const DeformingGroup& group, std::uint32_t first_triangle, TimeNs t, SceneTriangles& triangles)
      : group_(group), first_triangle_(first_triangle), t_(t), triangles_(triangles) {}

  const DeformedGroup& get() const {
    std::call_once(once_, [this] {
      deformed_ = group_.at(t_);
      group_.describe(*deformed_, first_triangle_, triangles_);
    });
    return *deformed_;
  }

  /// Velocity of a point relative to the object's frame, m/s.
  Eigen::Vector3f velocity(const SurfacePoint& point) const { return group_.velocity(get(), point); }

 private:
  const DeformingGroup& group_;
  std::uint32_t first_triangle_;
  TimeNs t_;
  SceneTriangles& triangles_;
  mutable std::once_flag once_;
  mutable std::shared_ptr<const DeformedGroup> deformed_;
};

}  // namespace esim::inline backends::inline raycast
