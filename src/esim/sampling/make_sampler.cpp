#include "esim/sampling/make_sampler.h"

#include "esim/sampling/frame_sampler.h"

namespace esim {

std::unique_ptr<Sampler> make_sampler(const SamplingOptions& options, const SamplingContext& context) {
  return std::visit([&](const auto& scheme) { return make_frame_sampler(scheme, context); }, options);
}

}  // namespace esim
