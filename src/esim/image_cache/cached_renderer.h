#pragma once

#include <memory>
#include <string>

#include "esim/core/parallel.h"
#include "esim/geometry/camera.h"
#include "esim/image_cache/image_cache.h"
#include "esim/render/renderer.h"

namespace esim::inline image_cache {

/// A renderer that gives the samples of `engine`, but asks it only for those that are not in the cache. `scene`
/// identifies the engine, its scene and its options. E, Z and the objects must follow from `scene`, the camera, and the
/// poses of the camera and of the objects: neither from the time nor from the twists. V is computed from the stored
/// images (render/motion_field). Returns `engine` itself if `cache` is null.
std::unique_ptr<Renderer> with_image_cache(std::unique_ptr<Renderer> engine, std::shared_ptr<ImageCache> cache,
                                           std::string scene, const Camera& camera, const Workers& workers);

}  // namespace esim::inline image_cache
