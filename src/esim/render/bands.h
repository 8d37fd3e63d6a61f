#pragma once

#include <functional>
#include <span>

#include "esim/core/parallel.h"
#include "esim/render/pixel_rays.h"
#include "esim/render/renderer.h"

namespace esim {

/// What every renderer begins with: makes room in `sample`, and says in it what it answers.
void prepare(std::span<const RenderRequest> requests, int width, int height, Sample& sample);

/// What renderers on the CPU share: prepares `sample`, cuts the requests' tiles into bands of a few rows, calls `shade`
/// for each of them in parallel to fill E, Z and, where the requests name objects, which of them is seen, and derives V
/// from that and the twists. A band is of the request with the index `which`.
void render_in_bands(std::span<const RenderRequest> requests, const PixelRays& rays, const Workers& workers,
                     Sample& sample, const std::function<void(std::size_t which, const Tile& band)>& shade);

/// The same for a `shade` that fills V as well.
void render_in_bands(std::span<const RenderRequest> requests, int width, int height, const Workers& workers,
                     Sample& sample, const std::function<void(std::size_t which, const Tile& band)>& shade);

}  // namespace esim
