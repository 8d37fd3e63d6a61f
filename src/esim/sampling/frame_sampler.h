#pragma once

#include <functional>
#include <memory>

#include "esim/sampling/context.h"
#include "esim/sampling/options.h"
#include "esim/sampling/sampler.h"

namespace esim::inline sampling {

/// Time from a sample until the next one, s.
using WantedInterval = std::function<double(const Sample& sample)>;

// Samplers of the whole image at once, as in the paper. The first sample is at the span's start and the last exactly at
// its end.

/// The interval is the wanted one, within the bounds on the rate.
std::unique_ptr<Sampler> make_frame_sampler(const WantedInterval& wanted_s, const RateBounds& bounds,
                                            const SamplingContext& context);

/// The rate is fixed.
std::unique_ptr<Sampler> make_frame_sampler(const UniformSampling& uniform, const SamplingContext& context);

}  // namespace esim::inline sampling
