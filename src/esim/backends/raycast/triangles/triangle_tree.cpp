#include "esim/backends/raycast/triangles/triangle_tree.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <tuple>

#include "esim/core/error.h"

namespace esim::inline backends::inline raycast {
namespace {

using Vector = Eigen::Vector3f;

struct Piece {
  Eigen::AlignedBox3f box;
  std::uint32_t index;
};

float half_area(const Eigen::AlignedBox3f& box) {
  if (box.isEmpty()) return 0;
  const Vector side = box.sizes();
  return side.x() * side.y() + side.y() * side.z() + side.z() * side.x();
}

/// Divides pieces in two so that a ray meets few of their boxes: the cut with the smallest sum of area times number,
/// out of 15 along each axis. Returns the beginning of the second part; neither part is empty.
std::span<Piece>::iterator cut(std::span<Piece> pieces) {
  constexpr int kBins = 16;
  struct Bin {
    Eigen::AlignedBox3f box;
    int count = 0;
  };
  Eigen::AlignedBox3f middles;
  for (const Piece& piece : pieces) middles.extend(piece.box.center());
  const auto bin_of = [&](const Piece& piece, int axis) {
    const float along = (piece.box.center()[axis] - middles.min()[axis]) / middles.sizes()[axis];
    if (!(along > 0)) return 0;  // also for NaN
    return along < 1 ? static_cast<int>(along * kBins) : kBins - 1;
  };

  float min = std::numeric_limits<float>::infinity();
  int best_axis = -1, best_bin = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(middles.sizes()[axis] > 0)) continue;
    std::array<Bin, kBins> bins;
    for (const Piece& piece : pieces) {
      Bin& bin = bins[static_cast<std::size_t>(bin_of(piece, axis))];
      bin.box.extend(piece.box), ++bin.count;
    }
    std::array<float, kBins> before{};  // cost of the previous bins
    Bin sum;
    for (std::size_t i = 1; i < kBins; ++i) {
      sum.box.extend(bins[i - 1].box), sum.count += bins[i - 1].count;
      before[i] = half_area(sum.box) * static_cast<float>(sum.count);
    }
    sum = {};
    for (int i = kBins - 1; i > 0; --i) {
      const Bin& bin = bins[static_cast<std::size_t>(i)];
      sum.box.extend(bin.box), sum.count += bin.count;
      const float cost = before[static_cast<std::size_t>(i)] + half_area(sum.box) * static_cast<float>(sum.count);
      if (sum.count > 0 && sum.count < static_cast<int>(pieces.size()) && cost < min)
        min = cost, best_axis = axis, best_bin = i;
    }
  }
  if (best_axis < 0) return pieces.begin() + static_cast<std::ptrdiff_t>(pieces.size() / 2);
  return std::stable_partition(pieces.begin(), pieces.end(),
                               [&](const Piece& piece) { return bin_of(piece, best_axis) < best_bin; });
}

}  // namespace

class TriangleTree::Builder {
 public:
  Builder(TriangleTree& tree, std::span<const Vector> vertices, std::span<const std::array<std::uint32_t, 3>> triangles)
      : tree_(tree), vertices_(vertices), triangles_(triangles) {}

  /// Adds the node of these triangles; the first node is the root.
  std::uint32_t add_node(std::span<Piece> pieces) {
    const auto index = static_cast<std::uint32_t>(tree_.nodes_.size());
    tree_.nodes_.emplace_back();
    std::vector<std::span<Piece>> parts = {pieces};
    while (parts.size() < kWide) {
      const auto largest = std::max_element(parts.begin(), parts.end(),
                                            [](const auto& a, const auto& b) { return a.size() < b.size(); });
      if (largest->size() <= kWide) break;
      const std::span<Piece> part = *largest;
      const auto middle = static_cast<std::size_t>(cut(part) - part.begin());
      *largest = part.first(middle);
      parts.push_back(part.subspan(middle));
    }
    Node node{};
    node.count = static_cast<int>(parts.size());
    for (std::size_t i = 0; i < parts.size(); ++i) {
      Eigen::AlignedBox3f box;
      for (const Piece& piece : parts[i]) box.extend(piece.box);
      node.set(i, box);
      node.child[i] = parts[i].size() <= kWide ? add_leaf(parts[i]) : add_node(parts[i]);
    }
    tree_.nodes_[index] = node;
    return index;
  }

 private:
  std::uint32_t add_leaf(std::span<const Piece> pieces) {
    Leaf leaf;
    for (std::size_t i = 0; i < kWide; ++i) leaf.index[i] = pieces[std::min(i, pieces.size() - 1)].index;
    tree_.place(leaf, vertices_, triangles_);
    tree_.leaves_.push_back(leaf);
    const auto place = static_cast<std::uint32_t>(tree_.leaves_.size() - 1);
    if (place >= kLastLane) throw UserError("mesh: has too many triangles; use a mesh with fewer than 200 million");
    return kLeaf | static_cast<std::uint32_t>(pieces.size() - 1) * kLastLane | place;
  }

  TriangleTree& tree_;
  std::span<const Vector> vertices_;
  std::span<const std::array<std::uint32_t, 3>> triangles_;
};

TriangleTree::TriangleTree(std::span<const Vector> vertices, std::span<const std::array<std::uint32_t, 3>> triangles) {
  // Most leaves are more than half full. Memory that is reserved but never written does not count, and a vector that
  // grows would hold its leaves twice.
  leaves_.reserve(triangles.size() / (kWide / 2) + 1);
  std::vector<Piece> pieces;
  pieces.reserve(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    Piece piece{{}, static_cast<std::uint32_t>(i)};
    for (const std::uint32_t corner : triangles[i]) piece.box.extend(vertices[corner]);
    pieces.push_back(piece);
  }
  for (const Vector& vertex : vertices) extent_ = std::max(extent_, vertex.lpNorm<Eigen::Infinity>());
  if (!pieces.empty()) Builder(*this, vertices, triangles).add_node(pieces);
}

void TriangleTree::place(Leaf& leaf, std::span<const Vector> vertices,
                         std::span<const std::array<std::uint32_t, 3>> triangles) const {
  for (std::size_t i = 0; i < kWide; ++i) {
    const std::array<std::uint32_t, 3>& corners = triangles[leaf.index[i]];
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const Vector& vertex = vertices[corners[corner]];
      for (std::size_t axis = 0; axis < 3; ++axis)
        leaf.corner[corner][axis][i] = vertex[static_cast<Eigen::Index>(axis)];
    }
  }
}

void TriangleTree::refit(std::span<const Vector> vertices, std::span<const std::array<std::uint32_t, 3>> triangles) {
  extent_ = 0;
  for (const Vector& vertex : vertices) extent_ = std::max(extent_, vertex.lpNorm<Eigen::Infinity>());
  std::vector<Eigen::AlignedBox3f> leaf_boxes(leaves_.size()), node_boxes(nodes_.size());
  for (std::size_t l = 0; l < leaves_.size(); ++l) {
    Leaf& leaf = leaves_[l];
    place(leaf, vertices, triangles);
    std::array<std::array<float, 3>, 2> bounds;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      float min = leaf.corner[0][axis][0], max = min;
      for (std::size_t corner = 0; corner < 3; ++corner) {
#pragma omp simd reduction(min : min) reduction(max : max)
        for (std::size_t i = 0; i < kWide; ++i) {
          min = std::min(min, leaf.corner[corner][axis][i]);
          max = std::max(max, leaf.corner[corner][axis][i]);
        }
      }
      bounds[0][axis] = min, bounds[1][axis] = max;
    }
    leaf_boxes[l] = {Vector(bounds[0].data()), Vector(bounds[1].data())};
  }
  for (std::size_t n = nodes_.size(); n-- > 0;) {  // children come after their parents
    Node& node = nodes_[n];
    for (std::size_t i = 0; i < static_cast<std::size_t>(node.count); ++i) {
      const std::uint32_t child = node.child[i];
      const Eigen::AlignedBox3f& box = (child & kLeaf) != 0 ? leaf_boxes[child % kLastLane] : node_boxes[child];
      node.set(i, box);
      node_boxes[n].extend(box);
    }
  }
}

double TriangleTree::cost() const {
  double sum = 0;
  Eigen::AlignedBox3f all;
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(nodes_[n].count); ++i) {
      const Vector middle = nodes_[n].at(nodes_[n].middle, i), half = nodes_[n].at(nodes_[n].half, i);
      const Eigen::AlignedBox3f box(middle - half, middle + half);
      sum += half_area(box);
      if (n == 0) all.extend(box);
    }
  }
  return sum > 0 ? sum / half_area(all) : 0;
}

/// The camera's view within bounds: the inner side of four planes through the camera, in the tree's frame.
struct TriangleTree::Pyramid {
  std::array<std::array<float, 3>, 4> normal;
  std::array<float, 4> offset;
  Eigen::Matrix3f R_tree_camera;
  Vector camera;

  Pyramid(const BearingBounds& bounds, const Eigen::Matrix3f& R, const Vector& at, float extent)
      : R_tree_camera(R), camera(at) {
    constexpr float kRounding = 1e-5F;
    const std::array<Vector, 4> inwards = {Vector{1, 0, -bounds.left}, Vector{-1, 0, bounds.right},
                                           Vector{0, 1, -bounds.top}, Vector{0, -1, bounds.bottom}};
    for (std::size_t i = 0; i < 4; ++i) {
      const Vector n = R * inwards[i];
      normal[i] = {n.x(), n.y(), n.z()};
      offset[i] = kRounding * n.norm() * (extent + at.lpNorm<1>()) - n.dot(at);
    }
  }

  /// A bit for each of the boxes that may intersect it.
  unsigned meets(const Node& node) const {
    alignas(32) std::array<float, kWide> inside;
    inside.fill(1);
    for (std::size_t p = 0; p < 4; ++p) {
      const float x = normal[p][0], y = normal[p][1], z = normal[p][2];
      const float size_x = std::fabs(x), size_y = std::fabs(y), size_z = std::fabs(z);
#pragma omp simd
      for (std::size_t i = 0; i < kWide; ++i) {
        const float middle = x * node.middle[0][i] + y * node.middle[1][i] + z * node.middle[2][i] + offset[p];
        const float reach = size_x * node.half[0][i] + size_y * node.half[1][i] + size_z * node.half[2][i];
        inside[i] = std::min(inside[i], middle + reach);
      }
    }
    return not_negative(inside) & ((1U << node.count) - 1);
  }

  /// A bit for each of the triangles, up to the lane `last`, that may intersect it.
  unsigned meets(const Leaf& leaf, unsigned last) const {
    alignas(32) std::array<float, kWide> inside;
    inside.fill(1);
    for (std::size_t p = 0; p < 4; ++p) {
      const float x = normal[p][0], y = normal[p][1], z = normal[p][2];
#pragma omp simd
      for (std::size_t i = 0; i < kWide; ++i) {
        const auto side = [&](std::size_t c) {
          return x * leaf.corner[c][0][i] + y * leaf.corner[c][1][i] + z * leaf.corner[c][2][i];
        };
        inside[i] = std::min(inside[i], std::max(std::max(side(0), side(1)), side(2)) + offset[p]);
      }
    }
    return not_negative(inside) & ((2U << last) - 1);
  }

  static unsigned not_negative(const std::array<float, kWide>& values) {
    unsigned bits = 0;
    for (unsigned i = 0; i < kWide; ++i) bits |= (values[i] >= 0 ? 1U : 0U) << i;
    return bits;
  }
};

namespace {

/// p x q, which is bitwise the opposite of q x p.
Vector edge_normal(const Vector& p, const Vector& q) {
  const bool in_order = std::tie(p.x(), p.y(), p.z()) < std::tie(q.x(), q.y(), q.z());
  const Vector &from = in_order ? p : q, edge = (in_order ? q : p) - from;
  // Products are exact in double precision, so that the result does not depend on the compiler's contractions.
  const Vector normal = from.cast<double>().cross(edge.cast<double>()).cast<float>();
  return in_order ? normal : -normal;
}

SeenTriangle seen(const std::array<Vector, 3>& corners, std::uint32_t index, const Eigen::Matrix3f& R_tree_camera,
                  const Vector& camera) {
  constexpr float kRounding = 3e-7F;
  std::array<Vector, 3> p;
  for (std::size_t i = 0; i < 3; ++i) p[i].noalias() = R_tree_camera.transpose() * (corners[i] - camera);
  const Vector facing = (p[1] - p[0]).cross(p[2] - p[0]);
  const float distance = facing.dot(p[0]), side = distance < 0 ? -1.0F : 1.0F;
  SeenTriangle triangle;
  const auto set = [](std::array<float, 3>& to, const Vector& v) { to = {v.x(), v.y(), v.z()}; };
  triangle.min_facing = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector &from = p[(k + 1) % 3], &to = p[(k + 2) % 3];
    set(triangle.weight[k], side * edge_normal(from, to));
    triangle.min_facing += kRounding * from.lpNorm<1>() * (to - from).lpNorm<1>();
  }
  set(triangle.facing, side * facing);
  triangle.distance = side * distance;
  set(triangle.normal, (corners[1] - corners[0]).cross(corners[2] - corners[0]));
  triangle.index = index;
  return triangle;
}

}  // namespace

template <class Visit>
bool TriangleTree::walk(const Pyramid& pyramid, const Visit& visit) const {
  std::vector<std::uint32_t> waiting;
  waiting.reserve(256);
  waiting.push_back(0);
  while (!waiting.empty()) {
    const std::uint32_t next = waiting.back();
    waiting.pop_back();
    if ((next & kLeaf) == 0) {
      const Node& node = nodes_[next];
      for (unsigned met = pyramid.meets(node); met != 0; met &= met - 1)
        waiting.push_back(node.child[static_cast<std::size_t>(std::countr_zero(met))]);
      continue;
    }
    const Leaf& leaf = leaves_[next % kLastLane];
    const unsigned met = pyramid.meets(leaf, (next & ~kLeaf) / kLastLane);
    if (met != 0 && !visit(leaf, met)) return false;
  }
  return true;
}

bool TriangleTree::find(const BearingBounds& bounds, const Eigen::Matrix3f& R_tree_camera, const Vector& camera,
                        SeenTriangles& found) const {
  if (nodes_.empty()) return false;
  return walk(Pyramid(bounds, R_tree_camera, camera, extent_), [&](const Leaf& leaf, unsigned met) {
    for (; met != 0; met &= met - 1) {
      if (found.full()) return false;
      const auto i = static_cast<std::size_t>(std::countr_zero(met));
      const auto corner = [&](std::size_t c) {
        return Vector(leaf.corner[c][0][i], leaf.corner[c][1][i], leaf.corner[c][2][i]);
      };
      found.add(seen({corner(0), corner(1), corner(2)}, leaf.index[i], R_tree_camera, camera));
    }
    return true;
  });
}

void TriangleTree::find(const BearingBounds& bounds, const Eigen::Matrix3f& R_tree_camera, const Vector& camera,
                        std::vector<LeafTriangles>& found) const {
  if (nodes_.empty()) return;
  walk(Pyramid(bounds, R_tree_camera, camera, extent_), [&](const Leaf& leaf, unsigned met) {
    found.push_back({&leaf, met});
    return true;
  });
}

}  // namespace esim::inline backends::inline raycast
