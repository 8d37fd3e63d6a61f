#pragma once

#include <memory>

#include "esim/backends/raycast/raycast_renderer.h"

namespace esim::inline backends::inline raycast {

/// A scene for the rasteriser; may be shared by the renderers of several cameras.
std::shared_ptr<const RaycastScene> build_raster_scene(const Scene& scene);

struct RasterOptions {
  float background = 0.2F;     ///< irradiance where no surface is seen
  int samples_per_pixel = 16;  ///< 16 or 64; 1: each pixel shows what its centre sees
};

/// Renders triangles by projecting them: every pixel is the mean of all surfaces that are visible in it, weighted by
/// their areas. The cost is proportional to the tiles. The lens is exact in the centre of each pixel, and linear within
/// a pixel. Depth and motion field are those of the centre. Colour filters and `area` as for make_raycast_renderer().
std::unique_ptr<Renderer> make_raster_renderer(std::shared_ptr<const RaycastScene> scene, const RasterOptions& options,
                                               const Camera& camera, const Workers& workers,
                                               ColourFilters filters = ColourFilters::none, const PixelArea& area = {});

}  // namespace esim::inline backends::inline raycast
