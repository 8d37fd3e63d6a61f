#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "esim/core/parallel.h"
#include "esim/core/time.h"
#include "esim/geometry/camera.h"
#include "esim/render/deforming_surfaces.h"
#include "esim/render/pixel_area.h"
#include "esim/render/renderer.h"

namespace esim::inline sampling {

/// Properties of the event camera that a criterion may need.
struct SensorTraits {
  double contrast_threshold = 0.5;  ///< C of Eq. 2: the smaller of C+ and C-
  double log_eps = 0.001;           ///< L = ln(E + log_eps)
  bool mosaic = false;              ///< the pixels have colour filters
};

/// What a sampler knows of its camera.
struct SamplingContext {
  SensorTraits sensor;
  int width = 0, height = 0;  ///< of the image, px
  TimeSpan span;              ///< to sample: from the first sample at its start to the last one exactly at its end
  const Workers& workers;     ///< outlives the sampler
};

/// The scene, for samplers that request images of other cameras at the same pose.
struct SceneAccess {
  Camera camera;       ///< of the sampler
  Renderer& renderer;  ///< of this camera; outlives the making of the sampler, like make_renderer

  /// Poses of the camera and of the moving objects; no tiles. May be copied, and called at any known time.
  std::function<RenderRequest(TimeNs)> view_at;

  /// A renderer of the scene for another camera. With `area`, its pixels average over that; null if they cannot.
  std::function<std::unique_ptr<Renderer>(const Camera& camera, const std::optional<PixelArea>& area)> make_renderer;

  std::shared_ptr<const DeformingSurfaces> deforming{};  ///< null if all objects are rigid
};

}  // namespace esim::inline sampling
