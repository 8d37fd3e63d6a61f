#pragma once

#include <memory>
#include <string>
#include <vector>

#include "esim/backends/unrealcv/unrealcv_options.h"
#include "esim/core/parallel.h"
#include "esim/geometry/camera.h"
#include "esim/render/renderer.h"

namespace esim::inline backends::inline unrealcv {

class UnrealcvClient;

/// A connection to a program with UnrealCV's protocol, shared by the renderers of all cameras. It is opened when the
/// first image is waited for.
std::shared_ptr<UnrealcvClient> make_unrealcv_client(UnrealcvOptions options);

/// What the program says of itself: its version, and the names of its objects. Connects, and throws EngineError.
std::vector<std::string> description_by(UnrealcvClient& client);

/// Renders a camera's images with the program: E and Z come from the program; V follows from Z, the visible objects and
/// the twists. For cameras other than pinholes with square pixels and a central principal point, pixels are looked up
/// in a wider image (render/pinhole_lookup.h). See docs/methods/engines.md. `samples` per pixel are requested by a
/// command of esim's Blender server; 0: no such request. Throws UserError if the camera's field of view is too wide for
/// a pinhole; when rendering, EngineError, which names host and port.
std::unique_ptr<Renderer> make_unrealcv_renderer(std::shared_ptr<UnrealcvClient> client, const Camera& camera,
                                                 const Workers& workers, int samples = 0);

}  // namespace esim::inline backends::inline unrealcv
