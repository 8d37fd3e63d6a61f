#pragma once

#include <memory>

#include "esim/core/parallel.h"
#include "esim/sampling/criterion.h"
#include "esim/sampling/sampler.h"

namespace esim {

/// Samples the whole image at once, as the paper does: the first sample at the span's start, the last one exactly at
/// its end, and between them as the criterion says from each sample, within its bounds on the rate.
std::unique_ptr<Sampler> make_frame_sampler(const SamplingOptions& options, const SensorTraits& sensor, int width,
                                            int height, const TimeSpan& span, const Workers& workers);

}  // namespace esim
