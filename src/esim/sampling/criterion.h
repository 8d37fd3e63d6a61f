#pragma once

#include "esim/core/parallel.h"
#include "esim/render/sample.h"
#include "esim/sampling/context.h"
#include "esim/sampling/options.h"

namespace esim::inline sampling {

/// Time until the next sample, s; +inf if the criterion sees no change.
double wanted_interval_s(const BrightnessSampling& options, const SensorTraits&, const Sample&, const Workers&);
double wanted_interval_s(const FlowSampling& options, const SensorTraits&, const Sample&, const Workers&);

/// Fastest motion in the image, max |V| over the pixels with finite motion, px/s.
double fastest_motion_px_per_s(const Sample& sample, const Workers& workers);

/// Fastest expected change of brightness, max |dL/dt| = max |<grad L, V>| over the pixels (Eq. 1), 1/s. In a
/// `mosaic` differences are between pixels of the same colour.
double fastest_brightness_change_per_s(const Sample& sample, double log_eps, const Workers& workers,
                                       bool mosaic = false);

}  // namespace esim::inline sampling
