#pragma once

#include <functional>
#include <optional>

#include "esim/core/parallel.h"
#include "esim/core/time.h"
#include "esim/geometry/camera.h"
#include "esim/render/renderer.h"
#include "esim/sampling/measured_error.h"

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

  // For schemes that reproject: what is known of the views in advance.
  Camera camera{};
  RendererTraits renderer{};                        ///< of the scene's renderer
  std::function<RenderRequest(TimeNs)> view_at{};   ///< poses of the camera and of the moving objects; no tiles
  std::optional<MeasuredError> resampling_floor{};  ///< of keyframes, if it was measured
};

}  // namespace esim::inline sampling
