#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "esim/backends/raycast/raster/clipped_triangles.h"
#include "esim/backends/raycast/raster/fragment.h"
#include "esim/backends/raycast/raster/pixel_triangle.h"

// Private to .cpp files: includes hwy/highway.h.
namespace esim::inline backends::inline raycast {

/// Divides pixels in which one sheet of connected triangles is in front of everything else. That it is connected shows
/// that its triangles do not hide each other, so that no polygons need to be cut: most pixels of finely divided
/// surfaces are such pixels.
class Sheets {
 public:
  /// `triangles` must outlive it.
  explicit Sheets(const SceneTriangles& triangles) : triangles_(triangles) {}

  /// Begins with a cell, which must remain as it is.
  void begin(const CellSurfaces& surfaces, const ImageCell& cell) {
    surfaces_ = &surfaces, cell_ = &cell;
    slots_.clear();
  }

  /// Appends the fragments of a pixel, of which `found` are the triangles that may be visible. False, and none, if the
  /// pixel is not simple enough: unless the sheet in front covers the pixel, there must be a second one that covers it
  /// and is shaded once, or nothing.
  bool divide(std::uint16_t pixel, std::span<const PixelTriangle> found, std::vector<Fragment>& fragments);

  /// Joins the fragments of each surface that is continuous (see connect()) and nearly flat, from the `first` fragment
  /// on, which are all of one pixel.
  void join(std::vector<Fragment>& fragments, std::size_t first);

  /// Whether a triangle of the cell has a common side with another one, and is on the other side of it in the image.
  bool continues(std::uint32_t triangle, std::uint32_t other) {
    if (slots_.empty()) make_table();
    for (std::size_t side = 0; side < 3; ++side) {
      const Beyond& beyond = this->beyond(triangle, side);
      if (beyond.triangle == other) return !beyond.folds;
    }
    return false;
  }

 private:
  static constexpr std::uint32_t kNone = ~0U;

  /// What is beyond a side of a triangle of the cell.
  struct Beyond {
    std::uint32_t triangle = kNone;  ///< of the cell
    bool known = false;
    bool folds = false;      ///< it is on the same side in the image: this is an outline
    bool continues = false;  ///< the surface continues
  };

  /// A fold of a sheet in the pixel: a triangle of it and its side.
  struct Fold {
    std::uint32_t triangle;
    std::uint8_t side;
  };

  /// Connected triangles of `found`.
  struct Sheet {
    std::uint8_t number = 0;
    std::vector<std::uint32_t> members;
    std::vector<Fold> folds;
    float farthest = 0;            ///< lower bound of the inverse depth
    bool ends = false;             ///< in the pixel, other than by folds
    bool too_near = false;         ///< a part of it is behind the camera, or nearly
    bool continues = true;         ///< as one surface
    std::uint32_t middle = kNone;  ///< the triangle of the cell that covers the pixel's middle

    bool covers() const { return middle != kNone && folds.empty() && !ends; }
  };

  const Beyond& beyond(std::uint32_t triangle, std::size_t side) {
    Beyond& beyond = beyond_[triangle][side];
    if (!beyond.known) beyond = look_beyond(surfaces_->triangle(triangle), side);
    return beyond;
  }
  std::uint32_t find(std::uint32_t index) const;
  void make_table();
  Beyond look_beyond(const ScreenTriangle& here, std::size_t side) const;
  void grow(std::uint32_t first, Sheet& sheet);
  bool is_back(const Sheet& sheet, const Sheet& front);
  bool is_behind(const PixelTriangle& triangle, const Sheet& sheet) const;
  bool is_behind(const Sheet& sheet, const Sheet& front) const;
  bool is_rest_behind(const Sheet& sheet) const;
  bool meets_pixel(const ScreenTriangle& triangle) const;
  bool meets_pixel(const ScreenTriangle& triangle, std::size_t side) const;
  std::uint32_t nearest_of_rest() const;
  bool cover(std::vector<Fragment>& fragments);
  bool overlay(std::vector<Fragment>& fragments);
  bool is_one_surface(const Sheet& sheet) const;
  bool is_flat(const ScreenTriangle& one, const ScreenTriangle& other, float x, float y) const;
  bool append(const Sheet& sheet, std::vector<Fragment>& fragments);

  const SceneTriangles& triangles_;
  const CellSurfaces* surfaces_ = nullptr;
  const ImageCell* cell_ = nullptr;

  // Of the cell, made when they are first needed.
  std::vector<std::uint32_t> slots_;  // a hash table of its triangles by their indices in the scene; kNone: empty
  std::vector<std::array<Beyond, 3>> beyond_;  // of each of its triangles

  // Of the pixel.
  std::uint16_t pixel_ = 0;
  float x_ = 0, y_ = 0, half_width_ = 0, half_height_ = 0;  // as bearings
  std::span<const PixelTriangle> found_;
  std::vector<std::uint32_t> place_;  // of each of the cell's triangles in `found`, if `found` has it there
  std::vector<std::uint8_t> sheet_;   // of each of `found`: the number of its sheet, 0: none yet
  std::uint8_t sheet_count_ = 0;
  Sheet front_, back_, behind_, other_;
  bool has_back_ = false, has_behind_ = false;
  ClippedTriangles clipped_;
  std::vector<std::uint32_t> joined_;
};

}  // namespace esim::inline backends::inline raycast
