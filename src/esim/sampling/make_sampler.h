#pragma once

#include <memory>

#include "esim/sampling/context.h"
#include "esim/sampling/options.h"
#include "esim/sampling/sampler.h"

namespace esim::inline sampling {

/// Makes the sampler that the options describe. Throws UserError if it does not support the camera or the renderer, or
/// needs `scene` and it is null.
std::unique_ptr<Sampler> make_sampler(const SamplingOptions& options, const SamplingContext& context,
                                      const SceneAccess* scene = nullptr);

}  // namespace esim::inline sampling
