#pragma once

#include <memory>

#include "esim/sampling/context.h"
#include "esim/sampling/options.h"
#include "esim/sampling/sampler.h"

namespace esim::inline sampling {

/// Makes the sampler that the options describe. Throws UserError if it does not support the renderer.
std::unique_ptr<Sampler> make_sampler(const SamplingOptions& options, const SamplingContext& context);

/// The camera whose images or tiles the sampler requests: the context's own, or the keyframes' camera.
Camera sampled_camera(const SamplingOptions& options, const SamplingContext& context);

}  // namespace esim::inline sampling
