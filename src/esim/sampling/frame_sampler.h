#pragma once

#include <memory>
#include <variant>

#include "esim/sampling/context.h"
#include "esim/sampling/options.h"
#include "esim/sampling/sampler.h"

namespace esim::inline sampling {

/// The schemes that sample the whole image at once, as the paper does.
using FrameScheme = std::variant<FlowSampling, BrightnessSampling, UniformSampling>;

/// Places the first sample at the span's start and the last exactly at its end. The scheme determines each interval in
/// between from the sample at its start, within the bounds on the rate.
std::unique_ptr<Sampler> make_frame_sampler(const FrameScheme& scheme, const SamplingContext& context);

}  // namespace esim::inline sampling
