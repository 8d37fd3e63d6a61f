#pragma once

#include <cstdint>
#include <vector>

#include "esim/core/parallel.h"
#include "esim/reproject/depth_splat.h"
#include "esim/reproject/keyframe.h"

namespace esim::inline reproject {

/// The surfaces that a view sees at supersampling x supersampling places within each of its pixels. A cell has the size
/// of a keyframe pixel.
class Cells {
 public:
  /// `greatest_radius`: limit of the bearings that the lens maps.
  Cells(const KeyframeLayout& layout, double greatest_radius, const Workers& workers);

  /// Projects the keyframes' dense points into the cells, and finds the surfaces at the pixels' centres: the nearest
  /// one in the pixel if no point falls on the centre, and kNothing if no point falls into any of its cells. An edge
  /// crosses a pixel if it crosses one of its cells.
  void look(const std::vector<SeenPoints>& keyframes, bool moves, VisibleSurface& pixels);

  /// The nearness and the part of a surface.
  struct Seen {
    float nearness = VisibleSurface::kNothing;
    std::uint16_t part = 0;
  };

  /// The surface in the cell at column i and row j: kNothing if no point falls into it.
  Seen at(int i, int j) const {
    return {cells_.nearness(i, j), cells_.part.empty() ? std::uint16_t{0} : cells_.part(i, j)};
  }

 private:
  void look_at_row(int y, bool moves, VisibleSurface& pixels) const;
  Seen nearest_of(int left, int top, int width) const;

  int s_;  // cells per side of a pixel
  const Workers& workers_;
  DepthSplat splat_;
  VisibleSurface cells_;
};

}  // namespace esim::inline reproject
