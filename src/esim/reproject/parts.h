#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "esim/render/deforming_surfaces.h"
#include "esim/render/renderer.h"

namespace esim::inline reproject {

/// Transforms points from one view to another: for a bearing b and a nearness w = 1/Z in the first view, y = R b + w t
/// is the point in the second view divided by Z; it appears at y / y_z with the nearness w / y_z. w = 0 is infinity. R
/// is a rotation, unless the surface deforms.
struct ViewChange {
  Eigen::Matrix3f R;
  Eigen::Vector3f t;
};

/// The changes from view `from` to view `to` of what is rigid: [0] for the static scene, [i] for object i.
std::vector<ViewChange> view_changes(const RenderRequest& from, const RenderRequest& to);

/// Triangles of deforming objects in a view, in the camera frame.
struct PlacedTriangles {
  struct Triangle {
    std::uint16_t part;
    bool is_line;                    ///< or nearly one
    Eigen::Vector3d corner;          ///< the first one, m
    Eigen::Matrix3d sides, inverse;  ///< from that to the others, m, and the unit normal
  };

  const RenderRequest& view;
  std::vector<Triangle> triangles;  ///< in the order of the parts
};

/// The parts of a scene that move differently: 0 is the static scene, i is the rigid object i, and of objects that
/// deform, every triangle is a part of its own.
class SceneParts {
 public:
  /// A scene of rigid objects.
  SceneParts() = default;

  /// `surfaces`: null if all objects are rigid. Throws UserError if deforming objects have too many triangles.
  SceneParts(std::shared_ptr<const DeformingSurfaces> surfaces, std::size_t objects);

  /// The part that each pixel of a sample sees: its objects, unless some of them deform.
  Image<std::uint16_t> seen(const Sample& sample) const;

  /// Those of `parts` that deform, each once, in order.
  std::vector<std::uint16_t> deforming(std::span<const std::uint16_t> parts) const;

  /// Those of `wanted`, deforming parts in order, in a view.
  PlacedTriangles place(const RenderRequest& view, const std::vector<std::uint16_t>& wanted) const;

  /// The changes from one view to another, by part; of triangles, for those that are placed in both. The change of a
  /// triangle is the affine map that takes its corners and its unit normal to those at the other time.
  std::vector<ViewChange> changes(const PlacedTriangles& from, const PlacedTriangles& to) const;

 private:
  struct Triangles {
    std::size_t object, first, count;  // first: part
  };

  std::size_t object_of(std::uint16_t part) const;

  std::shared_ptr<const DeformingSurfaces> surfaces_;
  std::vector<Triangles> deforming_;  // of each deforming object
  std::size_t count_ = 0;             // of parts, if any object deforms
};

}  // namespace esim::inline reproject
