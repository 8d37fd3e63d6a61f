#include "esim/sampling/keyframes/supersampling.h"

#include <cmath>

#include "esim/core/fast_log.h"
#include "esim/geometry/so3.h"
#include "esim/reproject/reprojector.h"

namespace esim::inline sampling {
namespace {

MeasuredError measure_resampling_error(const KeyframeSetup& setup, const SamplingContext& context,
                                       const SceneAccess& scene) {
  const KeyframeLayout& layout = setup.layout;
  RenderRequest request = scene.view_at(context.span.start);
  request.tiles = {{0, 0, layout.camera.width, layout.camera.height}};
  Sample sample;
  setup.renderer->render(request, sample);
  Keyframe keyframe;
  Reprojector reprojector(layout, scene.renderer.traits().at_infinity, context.workers, setup.parts);
  reprojector.prepare(request, sample, setup.renderer->take_light(sample), keyframe);

  // Turn the view so that its samples lie as far as possible from the keyframe's pixels. If s is odd, the centres of
  // the sensor's pixels and of the places within them lie on keyframe pixels: turn by half a keyframe pixel. If s is
  // even, the centres of the sensor's pixels already lie between two keyframe pixels, but the places within them, if
  // used, do not: turn by a quarter.
  const double even = keyframe.narrow.root.empty() ? 0 : 0.25;
  const double turn = (layout.supersampling % 2 == 1 ? 0.5 : even) / layout.supersampling;
  SE3& pose = request.camera.T_world_body;
  pose.rotation = pose.rotation * so3_exp(Eigen::Vector3d(-turn / layout.sensor.fy, turn / layout.sensor.fx, 0));
  request.tiles = {{0, 0, layout.sensor.width, layout.sensor.height}};
  scene.renderer.render(request, sample);
  Reconstruction found;
  reprojector.reconstruct(keyframe, keyframe, request, Detail::whole, found);

  LogHistogram errors;
  const auto eps = static_cast<float>(context.sensor.log_eps);
  for (std::size_t i = 0; i < sample.irradiance.size(); ++i)
    errors.add(std::fabs(fast_log((found.irradiance.pixels()[i] + eps) / (sample.irradiance.pixels()[i] + eps))));
  return measured_error(errors);
}

}  // namespace

KeyframeSetup set_up_keyframes(const KeyframeSampling& options, const SamplingContext& context,
                               const SceneAccess& scene) {
  const double max_error = options.tolerance * context.sensor.contrast_threshold;
  const bool is_given = options.supersampling > 0;
  const SceneParts parts(scene.deforming, scene.view_at(context.span.start).objects.size());
  for (int s = is_given ? options.supersampling : kMinSupersampling;; ++s) {
    const KeyframeLayout layout = lay_out_keyframes(scene.camera, s, options.margin_px);
    KeyframeSetup setup{layout, std::make_unique<KeyframeRenderer>(layout, scene), parts, {}};
    setup.resampling_error = measure_resampling_error(setup, context, scene);
    if (is_given || s == kMaxSupersampling || setup.resampling_error.p99 <= max_error) return setup;
  }
}

}  // namespace esim::inline sampling
