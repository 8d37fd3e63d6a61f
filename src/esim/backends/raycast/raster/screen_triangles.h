#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "esim/backends/raycast/ray_blocks.h"
#include "esim/backends/raycast/triangles/triangle_tree.h"

// Private to backends/raycast.
namespace esim::inline backends::inline raycast {

/// Closer surfaces are invisible; m.
inline constexpr float kNearestDepth = 1e-3F;
inline constexpr float kMaxInverseDepth = 1 / kNearestDepth;

/// A linear function of the bearing (x, y, 1).
struct OfBearing {
  float x, y, one;

  float at(float bearing_x, float bearing_y) const { return x * bearing_x + y * bearing_y + one; }
};

/// A triangle as a camera sees it. A bearing hits it where no weight is negative; then the barycentric coordinates are
/// the weights divided by their sum, and the point's inverse depth is `inverse_depth`. No triangle needs to be clipped:
/// behind the camera, a weight is negative. The weights of two triangles at their common edge are opposite, up to a
/// power of two, so that no bearing passes between them.
struct ScreenTriangle {
  // Coefficients of its linear functions of the bearing: of the three weights, and of the inverse depth.
  alignas(16) std::array<float, 4> x, y, one;
  float farthest, nearest;  ///< bounds of the inverse depth on the triangle; infinite if it is partly too close
  std::array<float, 3> corner_x, corner_y;  ///< bearings of its corners, if it is not too close
  std::array<float, 3> normal;              ///< (p1 - p0) x (p2 - p0) in the frame of its group
  std::uint32_t group;                      ///< of the scene
  std::uint32_t index;                      ///< in the scene

  /// Whether a corner is that of another triangle.
  bool has_corner(std::size_t k, const ScreenTriangle& other, std::size_t corner) const {
    return corner_x[k] == other.corner_x[corner] && corner_y[k] == other.corner_y[corner];
  }
  /// Whether no part of it is too close; otherwise, its corners have no bearings.
  bool is_in_front() const { return nearest <= kMaxInverseDepth; }

  OfBearing weight(std::size_t k) const { return {x[k], y[k], one[k]}; }
  OfBearing inverse_depth() const { return {x[3], y[3], one[3]}; }

  /// The barycentric coordinates of the second and the third corner.
  std::array<float, 2> barycentric(float bearing_x, float bearing_y) const {
    const float w1 = weight(1).at(bearing_x, bearing_y), w2 = weight(2).at(bearing_x, bearing_y);
    const float sum = weight(0).at(bearing_x, bearing_y) + w1 + w2, per_sum = sum > 0 ? 1 / sum : 0;
    return {w1 * per_sum, w2 * per_sum};
  }
};

/// Triangles of a leaf of a triangle tree, as a camera sees them.
struct ScreenLeaf {
  static constexpr int kWide = TriangleTree::kWide;
  using Lanes = TriangleTree::Lanes;

  alignas(64) std::array<std::array<Lanes, 3>, 3> weight;
  alignas(64) std::array<Lanes, 3> inverse_depth, normal, corner_x, corner_y;
  alignas(64) Lanes left, right, top,
      bottom;                           ///< bounds of their bearings; infinite if one is partly behind the camera
  alignas(64) Lanes farthest, nearest;  ///< bounds of their inverse depths
  unsigned visible;                     ///< a bit for each triangle that is neither edge-on nor too close

  /// Projects the triangles; those that are not finite are invisible.
  void project(const TriangleTree::Leaf& leaf, const Eigen::Matrix3f& R_camera_tree, const Eigen::Vector3f& camera);

  BearingBounds bounds(std::size_t lane) const { return {left[lane], right[lane], top[lane], bottom[lane]}; }
  ScreenTriangle triangle(std::size_t lane) const;  ///< without group and index
};

}  // namespace esim::inline backends::inline raycast
