#pragma once

#include <cstdint>

#include "esim/core/image.h"

namespace esim::inline scene {

/// Options of a collage of opaque leaves.
struct DeadLeavesOptions {
  int width = 512, height = 512;         ///< px
  double min_radius_px = 4;              ///< minimum, of a leaf
  double max_radius_px = 160;            ///< maximum, of a leaf
  double darkest = 0.1, lightest = 1.0;  ///< bounds of the irradiance, whose logarithm is uniform
};

/// A dead-leaves image: opaque leaves at random positions occlude each other. Their radii have the density 1 / r^3
/// between the bounds, so that the image is scale-invariant like natural images (Lee, Mumford, Huang, "Occlusion models
/// for natural images", IJCV 2001). A leaf is an ellipse or a rectangle with uniform brightness, a gradient or stripes.
/// Edges are blurred by 0.6 px, as by a lens. The same seed and number give the same image.
Image<float> dead_leaves(const DeadLeavesOptions& options, std::uint64_t seed, std::uint32_t number);

}  // namespace esim::inline scene
