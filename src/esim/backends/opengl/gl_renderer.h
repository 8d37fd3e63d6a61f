#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "esim/geometry/camera.h"
#include "esim/render/renderer.h"
#include "esim/scene/scene.h"

namespace esim {

struct GlOptions {
  float background = 0.2F;      ///< irradiance where no surface is seen
  int samples_per_pixel = 1;    ///< for the irradiance; what the driver does not offer becomes the next lower it does
  std::optional<int> device{};  ///< index among gl_devices(); where not set, the first that is no software
};

/// A device that OpenGL can be run on without a window.
struct GlDevice {
  std::string name;       ///< the driver's
  bool software = false;  ///< runs on the processor, as Mesa's llvmpipe does
};

/// In the order of their index. Empty where EGL or OpenGL is not installed.
std::vector<GlDevice> gl_devices();

/// Renders triangles with OpenGL 4.5, headless, through EGL: on a graphics card, or in software. What lens distortion
/// shows is looked up in a wider pinhole image of at least the camera's resolution. Surfaces closer than 1 mm are cut.
/// Lights cast shadows by maps of depth; see docs/methods/rendering.md.
/// Each renderer has a context of its own; it may be used by any one thread at a time.
/// Throws UserError naming what to install or to change where there is no such device, and where the camera's view is
/// too wide for a pinhole.
std::unique_ptr<Renderer> make_gl_renderer(const Scene& scene, const GlOptions& options, const Camera& camera);

}  // namespace esim
