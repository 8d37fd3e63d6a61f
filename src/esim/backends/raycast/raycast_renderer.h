#pragma once

#include <memory>

#include "esim/core/colour/colour.h"
#include "esim/core/parallel.h"
#include "esim/geometry/camera.h"
#include "esim/render/pixel_area.h"
#include "esim/render/renderer.h"
#include "esim/scene/scene.h"

namespace esim::inline backends::inline raycast {

/// A scene with its ray-casting accelerator; may be shared by the renderers of several cameras.
class RaycastScene;
std::shared_ptr<const RaycastScene> build_raycast_scene(const Scene& scene);

struct RaycastOptions {
  float background = 0.2F;    ///< irradiance where no surface is hit
  int samples_per_pixel = 1;  ///< 1, or 16 or 64 if an edge crosses the pixel; depth is that of its centre
};

/// Renders triangles by ray casting with Embree: the cost is proportional to the tiles, lens distortion is exact, and
/// edges and textures are averaged over `area`. With colour filters, all rays of a pixel see the materials in its
/// colour, or luminance if the scene has no colours.
std::unique_ptr<Renderer> make_raycast_renderer(std::shared_ptr<const RaycastScene> scene,
                                                const RaycastOptions& options, const Camera& camera,
                                                const Workers& workers, ColourFilters filters = ColourFilters::none,
                                                const PixelArea& area = {});

}  // namespace esim::inline backends::inline raycast
