#pragma once

#include <memory>

#include "esim/backends/unrealcv/unrealcv_options.h"
#include "esim/core/parallel.h"
#include "esim/geometry/camera.h"
#include "esim/render/renderer.h"

namespace esim {

class UnrealcvClient;

/// A connection with a program that speaks UnrealCV's protocol, to be shared by the renderers of all cameras. Nothing
/// is sent before the first image is waited for.
std::shared_ptr<UnrealcvClient> make_unrealcv_client(UnrealcvOptions options);

/// Lets the program render what a camera sees: E and Z are the program's, V follows from Z, from which object a pixel
/// sees, and from the twists. Cameras that are no pinholes with square pixels and the principal point in the middle are
/// looked up in a wider image (render/pinhole_lookup.h). Docs: docs/methods/engines.md.
/// `samples` per pixel are asked for by a command that our server in Blender knows; 0: none are.
/// Throws UserError where the camera's view is too wide for a pinhole; when rendering, EngineError naming host and
/// port.
std::unique_ptr<Renderer> make_unrealcv_renderer(std::shared_ptr<UnrealcvClient> client, const Camera& camera,
                                                 const Workers& workers, int samples = 0);

}  // namespace esim
