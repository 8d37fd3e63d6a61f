#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "esim/backends/raycast/ray_blocks.h"

namespace esim::inline backends::inline raycast {

/// A triangle as a camera sees it. For the ray r = (x, y, 1) and the triangle with the corners p0, p1, p2, all in the
/// camera frame, weight k is the triple product of r with the two other corners. If no weight is negative, r hits the
/// triangle at the barycentric coordinates weight k / (facing . r) and the depth distance / (facing . r). The weights
/// of two triangles at their common edge are bitwise opposite, so that no ray passes between them.
struct SeenTriangle {
  std::array<std::array<float, 3>, 3> weight;
  std::array<float, 3> facing;  ///< normal to the plane, away from the camera
  float distance;
  float min_facing;             ///< lower bound of facing . r unless the triangle is seen edge-on
  std::array<float, 3> normal;  ///< (p1 - p0) x (p2 - p0) in the triangles' own frame
  std::uint32_t index;
};

/// A container for a few triangles.
class SeenTriangles {
 public:
  static constexpr std::size_t kMax = 48;

  std::size_t size() const { return count_; }
  bool full() const { return count_ == kMax; }
  void add(const SeenTriangle& triangle) { triangles_[count_++] = triangle; }

  /// Keeps only the first `count`.
  void shrink(std::size_t count) { count_ = count; }

  /// The triangles from `first` on.
  std::span<const SeenTriangle> from(std::size_t first) const {
    return std::span(triangles_).first(count_).subspan(first);
  }

 private:
  std::array<SeenTriangle, kMax> triangles_;
  std::size_t count_ = 0;
};

/// Triangles in a hierarchy of boxes, eight per node, to find those that a small part of an image may see. If these are
/// few, it is faster to test each ray against all of them than to traverse the hierarchy for each ray.
class TriangleTree {
 public:
  TriangleTree() = default;
  TriangleTree(std::span<const Eigen::Vector3f> vertices, std::span<const std::array<std::uint32_t, 3>> triangles);

  static constexpr int kWide = 8;
  using Lanes = std::array<float, kWide>;

  /// Up to eight triangles: corner by corner, coordinate by coordinate. The remaining lanes repeat the last one.
  struct alignas(64) Leaf {
    std::array<std::array<Lanes, 3>, 3> corner;
    std::array<std::uint32_t, kWide> index;
  };

  /// Triangles of a leaf, a bit for each.
  struct LeafTriangles {
    const Leaf* leaf;
    unsigned triangles;
  };

  bool empty() const { return nodes_.empty(); }

  /// Moves the triangles, as many as before, to other vertices. The hierarchy keeps its branches, so that a tree whose
  /// triangles have moved relative to each other is slower than a new one.
  void refit(std::span<const Eigen::Vector3f> vertices, std::span<const std::array<std::uint32_t, 3>> triangles);

  /// The sum of the areas of all boxes in proportion to that of the largest: how many of them a ray may have to test.
  double cost() const;

  /// Adds the triangles that a camera may see in these bounds, in an order that depends on nothing else. False if they
  /// do not all fit, or if there is no tree.
  bool find(const BearingBounds& bounds, const Eigen::Matrix3f& R_tree_camera, const Eigen::Vector3f& camera,
            SeenTriangles& found) const;

  /// The same triangles by their leaves, any number of them.
  void find(const BearingBounds& bounds, const Eigen::Matrix3f& R_tree_camera, const Eigen::Vector3f& camera,
            std::vector<LeafTriangles>& found) const;

 private:
  /// The boxes of eight nodes or leaves: centres and half sides.
  struct alignas(64) Node {
    std::array<Lanes, 3> middle, half;
    std::array<std::uint32_t, kWide> child;  // in nodes_; or kLeaf, a leaf's last lane, and its place in leaves_
    int count;

    void set(std::size_t i, const Eigen::AlignedBox3f& box) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<Eigen::Index>(axis);
        middle[axis][i] = box.center()[a], half[axis][i] = 0.5F * box.sizes()[a];
      }
    }
    static Eigen::Vector3f at(const std::array<Lanes, 3>& lanes, std::size_t i) {
      return {lanes[0][i], lanes[1][i], lanes[2][i]};
    }
  };
  static constexpr std::uint32_t kLeaf = 1U << 31, kLastLane = 1U << 28;

  struct Pyramid;
  class Builder;

  void place(Leaf& leaf, std::span<const Eigen::Vector3f> vertices,
             std::span<const std::array<std::uint32_t, 3>> triangles) const;

  /// Calls visit(leaf, triangles) for every leaf with triangles in the pyramid, until it returns false.
  template <class Visit>
  bool walk(const Pyramid& pyramid, const Visit& visit) const;

  std::vector<Node> nodes_;  // the root first
  std::vector<Leaf> leaves_;
  float extent_ = 0;  // maximum coordinate
};

}  // namespace esim::inline backends::inline raycast
