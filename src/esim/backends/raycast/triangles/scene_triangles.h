#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "esim/backends/raycast/triangles/group_triangles.h"

// Private to backends/raycast.
namespace esim::inline backends::inline raycast {

/// The data of a scene's triangles at one time, in pages of which each belongs to one list of triangles.
class SceneTriangles {
 public:
  static constexpr std::uint32_t kPage = 4096;  ///< triangles

  const TriangleShading& triangle(std::uint32_t index) const { return shading_[index / kPage][index % kPage]; }

  /// The normals at a triangle's corners; null or of length 0 if it is flat.
  const CornerNormals* corner_normals(std::uint32_t index) const {
    const CornerNormals* const page = normals_[index / kPage];
    return page != nullptr ? page + index % kPage : nullptr;
  }

  /// Reserves indices for `count` triangles, and returns the first one.
  std::uint32_t add(std::size_t count) {
    const auto first = static_cast<std::uint32_t>(shading_.size() * kPage);
    shading_.resize(shading_.size() + (count + kPage - 1) / kPage, nullptr);
    normals_.resize(shading_.size(), nullptr);
    return first;
  }

  /// Sets the data of the triangles from `first` on, which must remain where they are. Of normals, there may be fewer
  /// than triangles, but none of a page that begins.
  void set(std::uint32_t first, std::span<const TriangleShading> shading, std::span<const CornerNormals> normals) {
    for (std::size_t i = 0; i < shading.size(); i += kPage) {
      shading_[(first + i) / kPage] = &shading[i];
      normals_[(first + i) / kPage] = i < normals.size() ? &normals[i] : nullptr;
    }
  }

 private:
  std::vector<const TriangleShading*> shading_;
  std::vector<const CornerNormals*> normals_;
};

}  // namespace esim::inline backends::inline raycast
