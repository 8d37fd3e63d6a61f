#pragma once

#include <cstdint>
#include <vector>

#include "esim/core/parallel.h"
#include "esim/reproject/depth_splat.h"
#include "esim/reproject/keyframe.h"

namespace esim {

/// What a view sees at supersampling x supersampling places within each of its pixels: a cell is as large as one of the
/// keyframes' pixels.
class Cells {
 public:
  /// `greatest_radius`: of bearings that the lens takes.
  Cells(const KeyframeLayout& layout, double greatest_radius, const Workers& workers);

  /// Finds what the cells see of the keyframes' dense points, and what the pixels do at their centres: kNothing where
  /// no point falls into any of their cells. An edge crosses a pixel where it crosses one of its cells.
  void look(const std::vector<SeenPoints>& keyframes, const RenderRequest& view, VisibleSurface& pixels);

  /// A surface's nearness, and the object that it is on.
  struct Seen {
    float nearness = VisibleSurface::kNothing;
    std::uint16_t object = 0;
  };

  /// What the cell in column i and row j sees: kNothing where no point falls.
  Seen at(int i, int j) const {
    return {cells_.nearness(i, j), cells_.object.empty() ? std::uint16_t{0} : cells_.object(i, j)};
  }

 private:
  Seen at_centre(int x, int y) const;
  Seen nearest_of(int left, int top, int width) const;
  Edge edge_in(int x, int y) const;

  int s_;  // cells along a pixel's side
  const Workers& workers_;
  DepthSplat splat_;
  VisibleSurface cells_;
};

}  // namespace esim
