#pragma once

#include <memory>

#include "esim/core/parallel.h"
#include "esim/geometry/camera.h"
#include "esim/geometry/se3.h"
#include "esim/render/renderer.h"
#include "esim/scene/images/colour_textures.h"

namespace esim::inline backends::inline plane {

/// A textured rectangle at a pose, visible from both sides. In its own frame it lies in z = 0 with its centre at the
/// origin, x to the right and y downwards in the image, so that z points into the wall: a camera with the same
/// orientation in front of it (at negative z) sees it upright.
struct TexturedPlane {
  std::shared_ptr<const Texture> radiance;
  SE3 T_world_plane;
  double width_m = 1.0;      ///< the height follows from the image's aspect ratio
  bool endless = false;      ///< the image repeats over an infinite plane
  float background = 0.2F;   ///< irradiance where the rectangle is not hit
  ColourTextures colours{};  ///< for cameras with colour filters; without them these see luminance
};

/// `footprint`: side of the square that a pixel averages over, px.
std::unique_ptr<Renderer> make_plane_renderer(TexturedPlane plane, const Camera& camera, const Workers& workers,
                                              ColourFilters filters = ColourFilters::none, double footprint = 1);

}  // namespace esim::inline backends::inline plane
