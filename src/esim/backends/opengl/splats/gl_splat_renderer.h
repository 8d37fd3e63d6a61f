#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "esim/geometry/camera.h"
#include "esim/render/renderer.h"
#include "esim/scene/splats/splat_objects.h"

namespace esim::inline backends::inline opengl {

/// Renders Gaussian splats by compute shaders of OpenGL 4.5, headless, through EGL. Images are those of
/// backends/splats/splat_renderer.h up to rounding and up to the order of splats at the same distance, without surfaces
/// among the splats and without colour filters. Splats that are far away are not merged.
/// `device`: index into gl_devices(); by default the first that is not software. `footprint`: side of the square that
/// pixels average over, px.
///
/// All objects must have the same SplatLight. Each renderer has its own context; only one thread may use it at a time.
/// Throws UserError if there is no such device, if the splats are too many for it, or for SplatOrder::ray; so do
/// renderings that need too much memory.
std::unique_ptr<Renderer> make_gl_splat_renderer(const std::vector<SplatObject>& objects, const SplatOptions& options,
                                                 const Camera& camera, std::optional<int> device, double footprint = 1);

}  // namespace esim::inline backends::inline opengl
