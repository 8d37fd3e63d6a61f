#include "esim/sampling/make_sampler.h"

#include "esim/sampling/adaptive/adaptive.h"
#include "esim/sampling/criterion.h"
#include "esim/sampling/frame_sampler.h"
#include "esim/sampling/keyframes/keyframe_sampler.h"

namespace esim::inline sampling {
namespace {

// One overload per method, except those that only have an interval (criterion.h).

template <typename Criterion>
std::unique_ptr<Sampler> make(const Criterion& criterion, const SamplingContext& context, const SceneAccess*) {
  const auto wanted_s = [criterion, sensor = context.sensor, &workers = context.workers](const Sample& sample) {
    return wanted_interval_s(criterion, sensor, sample, workers);
  };
  return make_frame_sampler(wanted_s, criterion.bounds, context);
}
std::unique_ptr<Sampler> make(const UniformSampling& method, const SamplingContext& context, const SceneAccess*) {
  return make_frame_sampler(method, context);
}
std::unique_ptr<Sampler> make(const AdaptiveSampling& method, const SamplingContext& context, const SceneAccess*) {
  return make_adaptive_sampler(method, context);
}
std::unique_ptr<Sampler> make(const KeyframeSampling& method, const SamplingContext& context,
                              const SceneAccess* scene) {
  return make_keyframe_sampler(method, context, scene);
}

}  // namespace

std::unique_ptr<Sampler> make_sampler(const SamplingOptions& options, const SamplingContext& context,
                                      const SceneAccess* scene) {
  return std::visit([&](const auto& method) { return make(method, context, scene); }, options);
}

}  // namespace esim::inline sampling
