#pragma once

#include <memory>

#include "esim/sampling/context.h"
#include "esim/sampling/options.h"
#include "esim/sampling/sampler.h"

namespace esim {

/// Makes the sampler that the options describe. Throws UserError where the renderer does not suit it.
std::unique_ptr<Sampler> make_sampler(const SamplingOptions& options, const SamplingContext& context);

/// The camera whose whole images or tiles that sampler asks for: the context's own, or a keyframe's.
Camera sampled_camera(const SamplingOptions& options, const SamplingContext& context);

}  // namespace esim
