#pragma once

#include <memory>

#include "esim/sampling/context.h"
#include "esim/sampling/options.h"
#include "esim/sampling/sampler.h"

namespace esim {

/// Makes the sampler that the options describe.
std::unique_ptr<Sampler> make_sampler(const SamplingOptions& options, const SamplingContext& context);

}  // namespace esim
