#pragma once

#include "esim/core/parallel.h"
#include "esim/core/time.h"

namespace esim {

/// Properties of the event camera that a criterion may need.
struct SensorTraits {
  double contrast_threshold = 0.5;  ///< C of Eq. 2: the smaller one of C+ and C-
  double log_eps = 0.001;           ///< L = ln(E + log_eps)
};

/// What a sampler is told of the camera that it serves.
struct SamplingContext {
  SensorTraits sensor;
  int width = 0, height = 0;  ///< of the image, px
  TimeSpan span;              ///< to sample: the first sample at its start, the last exactly at its end
  const Workers& workers;     ///< outlives the sampler
};

}  // namespace esim
