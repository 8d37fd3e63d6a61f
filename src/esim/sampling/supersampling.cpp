#include "esim/sampling/supersampling.h"

#include <cmath>

#include "esim/core/fast_log.h"
#include "esim/geometry/so3.h"
#include "esim/reproject/reprojector.h"
#include "esim/sampling/keyframes.h"

namespace esim::inline sampling {

MeasuredError measure_resampling_floor(const KeyframeLayout& layout, RenderRequest request,
                                       const SamplingContext& context, Renderer& sensor, Renderer& keyframes) {
  request.tiles = {{0, 0, layout.camera.width, layout.camera.height}};
  Sample sample;
  keyframes.render(request, sample);
  Keyframe keyframe;
  Reprojector reprojector(layout, context.renderer.at_infinity, context.workers);
  reprojector.prepare(request, sample, keyframe);

  // Turn the view so that its samples lie as far as possible from the keyframe's pixels. If s is odd, the centres of
  // the sensor's pixels and of the places within them lie on keyframe pixels: turn by half a keyframe pixel. If s is
  // even, the centres of the sensor's pixels already lie between two keyframe pixels, but the places within them, if
  // used, do not: turn by a quarter.
  const double even = keyframe.narrow.root.empty() ? 0 : 0.25;
  const double turn = (layout.supersampling % 2 == 1 ? 0.5 : even) / layout.supersampling;
  SE3& pose = request.camera.T_world_body;
  pose.rotation = pose.rotation * so3_exp(Eigen::Vector3d(-turn / layout.sensor.fy, turn / layout.sensor.fx, 0));
  request.tiles = {{0, 0, layout.sensor.width, layout.sensor.height}};
  sensor.render(request, sample);
  Reconstruction found;
  reprojector.reconstruct(keyframe, keyframe, request, Detail::whole, found);

  LogHistogram errors;
  const auto eps = static_cast<float>(context.sensor.log_eps);
  for (std::size_t i = 0; i < sample.irradiance.size(); ++i)
    errors.add(std::fabs(fast_log((found.irradiance.pixels()[i] + eps) / (sample.irradiance.pixels()[i] + eps))));
  return measured_error(errors);
}

KeyframeSampling decide_supersampling(const KeyframeSampling& options, const RenderRequest& view,
                                      SamplingContext& context, Renderer& sensor, const MakeRenderer& make_renderer) {
  KeyframeSampling decided = options;
  const double most = options.tolerance * context.sensor.contrast_threshold;
  for (int s = kLeastSupersampling; s <= kMostSupersampling; ++s) {
    if (options.supersampling == 0) decided.supersampling = s;
    const KeyframeLayout layout = lay_out_keyframes(decided, context);
    context.resampling_floor = measure_resampling_floor(layout, view, context, sensor, *make_renderer(layout.camera));
    if (options.supersampling > 0 || context.resampling_floor->p99 <= most) break;
  }
  return decided;
}

}  // namespace esim::inline sampling
