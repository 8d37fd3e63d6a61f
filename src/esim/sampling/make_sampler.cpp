#include "esim/sampling/make_sampler.h"

#include "esim/sampling/adaptive/adaptive.h"
#include "esim/sampling/frame_sampler.h"
#include "esim/sampling/keyframes.h"

namespace esim::inline sampling {
namespace {

// One overload per scheme.

template <typename Scheme>
std::unique_ptr<Sampler> make(const Scheme& scheme, const SamplingContext& context) {
  return make_frame_sampler(scheme, context);
}
std::unique_ptr<Sampler> make(const AdaptiveSampling& scheme, const SamplingContext& context) {
  return make_adaptive_sampler(scheme, context);
}
std::unique_ptr<Sampler> make(const KeyframeSampling& scheme, const SamplingContext& context) {
  return make_keyframe_sampler(scheme, context);
}

}  // namespace

std::unique_ptr<Sampler> make_sampler(const SamplingOptions& options, const SamplingContext& context) {
  return std::visit([&](const auto& scheme) { return make(scheme, context); }, options);
}

Camera sampled_camera(const SamplingOptions& options, const SamplingContext& context) {
  const auto* keyframes = std::get_if<KeyframeSampling>(&options);
  return keyframes != nullptr ? lay_out_keyframes(*keyframes, context).camera : context.camera;
}

}  // namespace esim::inline sampling
