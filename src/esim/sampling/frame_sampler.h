#pragma once

#include <memory>
#include <variant>

#include "esim/sampling/context.h"
#include "esim/sampling/options.h"
#include "esim/sampling/sampler.h"

namespace esim {

/// The schemes that sample the whole image at once, as the paper does.
using FrameScheme = std::variant<FlowSampling, BrightnessSampling, UniformSampling>;

/// The first sample at the span's start, the last one exactly at its end, and between them as the scheme says from each
/// sample, within its bounds on the rate.
std::unique_ptr<Sampler> make_frame_sampler(const FrameScheme& scheme, const SamplingContext& context);

}  // namespace esim
