#include "esim/sampling/make_sampler.h"

#include "esim/sampling/frame_sampler.h"
#include "esim/sampling/keyframes.h"

namespace esim {

std::unique_ptr<Sampler> make_sampler(const SamplingOptions& options, const SamplingContext& context) {
  if (const auto* keyframes = std::get_if<KeyframeSampling>(&options))
    return make_keyframe_sampler(*keyframes, context);
  const auto make = [&](const auto& scheme) -> std::unique_ptr<Sampler> {
    if constexpr (std::is_constructible_v<FrameScheme, decltype(scheme)>) return make_frame_sampler(scheme, context);
    return nullptr;
  };
  return std::visit(make, options);
}

Camera sampled_camera(const SamplingOptions& options, const SamplingContext& context) {
  const auto* keyframes = std::get_if<KeyframeSampling>(&options);
  return keyframes != nullptr ? lay_out_keyframes(*keyframes, context).camera : context.camera;
}

}  // namespace esim
