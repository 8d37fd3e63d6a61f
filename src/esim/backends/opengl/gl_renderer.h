#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "esim/geometry/camera.h"
#include "esim/render/renderer.h"
#include "esim/scene/scene.h"

namespace esim::inline backends::inline opengl {

struct GlOptions {
  float background = 0.2F;      ///< irradiance where no surface is visible
  int samples_per_pixel = 1;    ///< for the irradiance; rounded down to a number that the driver supports
  std::optional<int> device{};  ///< index into gl_devices(); by default the first that is not software
};

/// A device that supports OpenGL without a window.
struct GlDevice {
  std::string name;       ///< from the driver
  bool software = false;  ///< runs on the processor, as Mesa's llvmpipe does
};

/// In the order of their index. Empty if EGL or OpenGL is not installed.
std::vector<GlDevice> gl_devices();

/// Renders triangles with OpenGL 4.5, headless, through EGL: on a graphics card, or in software. For lens distortion,
/// the pixels are looked up in a wider pinhole image of at least the camera's resolution. Surfaces closer than 1 mm are
/// clipped. Lights cast shadows by shadow maps; see docs/methods/rendering.md.
/// Each renderer has its own context; only one thread may use it at a time.
/// Throws UserError, which says what to install or to change, if there is no such device, or if the camera's field of
/// view is too wide for a pinhole.
std::unique_ptr<Renderer> make_gl_renderer(const Scene& scene, const GlOptions& options, const Camera& camera);

}  // namespace esim::inline backends::inline opengl
