#pragma once

#include <functional>
#include <optional>

#include "esim/core/parallel.h"
#include "esim/core/time.h"
#include "esim/geometry/camera.h"
#include "esim/render/renderer.h"
#include "esim/sampling/measured_error.h"

namespace esim {

/// Properties of the event camera that a criterion may need.
struct SensorTraits {
  double contrast_threshold = 0.5;  ///< C of Eq. 2: the smaller one of C+ and C-
  double log_eps = 0.001;           ///< L = ln(E + log_eps)
  bool mosaic = false;              ///< the pixels have colour filters
};

/// What a sampler is told of the camera that it serves.
struct SamplingContext {
  SensorTraits sensor;
  int width = 0, height = 0;  ///< of the image, px
  TimeSpan span;              ///< to sample: the first sample at its start, the last exactly at its end
  const Workers& workers;     ///< outlives the sampler

  // What is known of the views beforehand, for schemes that reproject.
  Camera camera{};                                  ///< the model
  RendererTraits renderer{};                        ///< that shows the scene
  std::function<RenderRequest(TimeNs)> view_at{};   ///< where the camera and the moving objects are; no tiles
  std::optional<MeasuredError> resampling_floor{};  ///< of keyframes, where it was measured
};

}  // namespace esim
