#pragma once

#include <cstdint>

#include "esim/core/image.h"

namespace esim {

/// What a collage of opaque leaves is made of.
struct DeadLeavesOptions {
  int width = 512, height = 512;         ///< px
  double least_radius_px = 4;            ///< of a leaf
  double greatest_radius_px = 160;       ///< of a leaf
  double darkest = 0.1, lightest = 1.0;  ///< irradiance, between which brightness is uniform in its logarithm
};

/// A dead-leaves image: opaque leaves at random places, each hiding what is below, with radii of density 1 / r^3
/// between the bounds, so that the image looks alike at all scales, as natural ones do (Lee, Mumford, Huang, "Occlusion
/// models for natural images", IJCV 2001). A leaf is an ellipse or a rectangle, of one brightness, with a gradient or
/// with stripes. Edges are those of a lens: blurred by 0.6 px. The same seed and number give the same image.
Image<float> dead_leaves(const DeadLeavesOptions& options, std::uint64_t seed, std::uint32_t number);

}  // namespace esim
