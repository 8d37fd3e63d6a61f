#pragma once

#include <functional>
#include <span>

#include "esim/core/parallel.h"
#include "esim/render/pixel_rays.h"
#include "esim/render/renderer.h"

namespace esim::inline render {

/// First step of every renderer: resizes `sample` and stores the request's time and tiles in it. `deforms`: it has
/// space for points on surfaces.
void prepare(std::span<const RenderRequest> requests, int width, int height, Sample& sample, bool deforms = false);

/// Shared by renderers on the CPU: prepares `sample`, cuts the requests' tiles into bands of a few rows, and calls
/// `shade` for each band in parallel. `shade` fills E, Z and, if the requests name objects, the visible object; V is
/// derived from these and the twists. `which` is the index of the band's request.
void render_in_bands(std::span<const RenderRequest> requests, const PixelRays& rays, const Workers& workers,
                     Sample& sample, const std::function<void(std::size_t which, const Tile& band)>& shade);

/// As above, for a `shade` that also fills V.
void render_in_bands(std::span<const RenderRequest> requests, int width, int height, const Workers& workers,
                     Sample& sample, const std::function<void(std::size_t which, const Tile& band)>& shade,
                     bool deforms = false);

}  // namespace esim::inline render
