#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "esim/backends/raycast/triangles/group_triangles.h"

// Private to backends/raycast.
namespace esim::inline backends::inline raycast {

/// The data of a scene's triangles at one time, in pages of which each belongs to one list of triangles. What depends
/// on the shape of deforming triangles is computed when it is needed, since an image sees few of them.
class SceneTriangles {
 public:
  static constexpr std::uint32_t kPage = 4096;  ///< triangles

  /// The data for shading, which may be in `memory`.
  const TriangleShading& triangle(std::uint32_t index, TriangleShading& memory) const {
    const Page& page = pages_[index / kPage];
    const TriangleShading& stored = page.shading[index % kPage];
    if (page.corners == nullptr) return stored;
    const auto& [a, b, c] = page.corners[index % kPage];
    memory = stored;
    memory.place(page.positions[a], page.positions[b], page.positions[c]);
    return memory;
  }

  std::uint32_t material(std::uint32_t index) const { return stored(index).material; }

  /// The triangle beyond the side opposite a corner.
  NextTriangle next(std::uint32_t index, std::size_t corner) const { return stored(index).next[corner]; }

  void prefetch(std::uint32_t index) const { __builtin_prefetch(&stored(index)); }

  /// The normals at a triangle's corners; of length 0 if it is flat.
  CornerNormals corner_normals(std::uint32_t index) const {
    const Page& page = pages_[index / kPage];
    if (page.normals != nullptr) return page.normals[index % kPage];
    if (page.vertex_normals == nullptr) return {kNone, kNone, kNone};
    const auto& [a, b, c] = page.corners[index % kPage];
    return {page.vertex_normals[a], page.vertex_normals[b], page.vertex_normals[c]};
  }

  /// Reserves indices for `count` triangles, and returns the first one.
  std::uint32_t add(std::size_t count) {
    const auto first = static_cast<std::uint32_t>(pages_.size() * kPage);
    pages_.resize(pages_.size() + (count + kPage - 1) / kPage);
    return first;
  }

  /// Sets the data of rigid triangles from `first` on, which must remain where they are. Of normals, there may be fewer
  /// than triangles, but none of a page that begins.
  void set(std::uint32_t first, std::span<const TriangleShading> shading, std::span<const CornerNormals> normals) {
    for (std::size_t i = 0; i < shading.size(); i += kPage)
      pages_[(first + i) / kPage] = {&shading[i], i < normals.size() ? &normals[i] : nullptr};
  }

  /// Sets the data of deforming triangles, likewise: with gradients of any shape, their corners, and the vertices with
  /// their normals at this time; null normals: flat.
  void set(std::uint32_t first, std::span<const TriangleShading> shading, std::span<const Corners> corners,
           const Eigen::Vector3f* positions, const Eigen::Vector3f* normals) {
    for (std::size_t i = 0; i < shading.size(); i += kPage)
      pages_[(first + i) / kPage] = {&shading[i], nullptr, &corners[i], positions, normals};
  }

 private:
  struct Page {
    const TriangleShading* shading = nullptr;
    const CornerNormals* normals = nullptr;
    const Corners* corners = nullptr;  // null: rigid
    const Eigen::Vector3f *positions = nullptr, *vertex_normals = nullptr;
  };

  const TriangleShading& stored(std::uint32_t index) const { return pages_[index / kPage].shading[index % kPage]; }

  inline static const Eigen::Vector3f kNone = Eigen::Vector3f::Zero();
  std::vector<Page> pages_;
};

}  // namespace esim::inline backends::inline raycast
