#pragma once

#include <memory>

#include "esim/core/parallel.h"
#include "esim/geometry/camera.h"
#include "esim/geometry/se3.h"
#include "esim/render/renderer.h"
#include "esim/scene/images/colour_textures.h"

namespace esim::inline backends::inline panorama {

/// An equirectangular image at infinity, for which only the camera's rotation matters.
///
/// In the panorama's frame z is up; the image's centre is in direction +x, its left quarter in direction +y, and its
/// upper edge is the zenith. Column and row of a direction d:
///     u = 1/2 - atan2(d_y, d_x) / 2pi,   v = 1/2 - atan2(d_z, |d_xy|) / pi   (fractions of width and height).
struct Panorama {
  std::shared_ptr<const Texture> radiance;  ///< wraps in u
  Eigen::Quaterniond R_world_panorama = Eigen::Quaterniond::Identity();
  ColourTextures colours{};  ///< for cameras with colour filters; without them these see luminance
};

/// `footprint`: side of the square that a pixel averages over, px.
std::unique_ptr<Renderer> make_panorama_renderer(Panorama panorama, const Camera& camera, const Workers& workers,
                                                 ColourFilters filters = ColourFilters::none, double footprint = 1);

}  // namespace esim::inline backends::inline panorama
