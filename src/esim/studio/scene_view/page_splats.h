#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "esim/scene/scene.h"

namespace esim::studio {

/// Splats in a format for browsers.
struct PageSplats {
  /// A .splat file in the coordinates of the object, with display colours that are the same in all directions.
  std::string bytes;
  std::size_t shown = 0, all = 0;  ///< numbers of splats: in `bytes`, and in the object
  SplatFilter filter = SplatFilter::dilated;
  Eigen::AlignedBox3d box;     ///< around all splats, in the coordinates of the object
  Eigen::AlignedBox3d middle;  ///< without the outermost hundredth of the splats on each side
};

inline constexpr std::size_t kMaxPageSplats = 1'000'000;

/// The splats of each object of a scene; empty for meshes. If all objects together have more than `max` splats, these
/// are the most visible ones: those with the largest products of opacity and area.
std::vector<std::optional<PageSplats>> page_splats(const Scene& scene, std::size_t max = kMaxPageSplats);

}  // namespace esim::studio
