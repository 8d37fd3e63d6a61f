#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "esim/backends/raycast/raster/image_cells.h"
#include "esim/backends/raycast/raster/screen_triangles.h"
#include "esim/backends/raycast/raycast_scene.h"

// Private to backends/raycast.
namespace esim::inline backends::inline raycast {

/// Pixels of a cell: columns and rows, from its corner.
struct CellPart {
  Range columns, rows;
};

/// A triangle that may be visible in a pixel.
struct Candidate {
  std::uint32_t triangle;     ///< of the cell's
  float nearest;              ///< upper bound of its inverse depth in the pixel
  std::uint16_t pixel;        ///< of the cell
  std::uint16_t fills_pixel;  ///< 1: covers the pixel completely, in front of the camera
};

/// Finds the triangles that may be visible in each pixel of a cell. What it finds for a pixel does not depend on which
/// other pixels are wanted.
class CellSurfaces {
 public:
  /// Collects the candidates of the pixels in `part`.
  void collect(const std::vector<PlacedGroup>& groups, const ImageCell& cell, const CellPart& part);

  /// Those of a pixel in that part. Triangles that others hide completely are not among them.
  std::span<const Candidate> at(int pixel) const {
    const auto p = static_cast<std::size_t>(pixel);
    return std::span(sorted_).subspan(begin_[p], begin_[p + 1] - begin_[p]);
  }

  std::size_t triangle_count() const { return triangles_.size(); }
  const ScreenTriangle& triangle(std::uint32_t index) const { return triangles_[index]; }

 private:
  void scan(const ScreenTriangle& triangle, const BearingBounds& bounds, const ImageCell& cell, const CellPart& part);
  void sort();

  std::vector<TriangleTree::LeafTriangles> leaves_;
  std::vector<ScreenTriangle> triangles_;
  std::vector<Candidate> found_, sorted_;
  std::size_t found_count_ = 0;
  alignas(64) std::array<float, ImageCell::kPixels> hidden_below_;  // inverse depth; what is farther is invisible
  std::array<std::uint32_t, ImageCell::kPixels + 1> begin_;         // of each pixel's candidates in sorted_
};

}  // namespace esim::inline backends::inline raycast
