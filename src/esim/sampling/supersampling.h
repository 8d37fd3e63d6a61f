#pragma once

#include <functional>
#include <memory>

#include "esim/reproject/keyframe.h"
#include "esim/sampling/context.h"
#include "esim/sampling/options.h"

namespace esim::inline sampling {

/// Makes a renderer of the scene for a camera.
using MakeRenderer = std::function<std::unique_ptr<Renderer>(const Camera&)>;

/// The resampling error: the error of brightness that remains even if a keyframe is at the sensor's own view. A
/// keyframe of this view is interpolated halfway between its pixels, where the error is largest, and compared with the
/// sensor's own image. Renders both.
MeasuredError measure_resampling_floor(const KeyframeLayout& layout, RenderRequest request,
                                       const SamplingContext& context, Renderer& sensor, Renderer& keyframes);

/// The same options with every value set. If the supersampling is 0, it becomes the smallest from 2 to 4 for which 99 %
/// of the pixels have a resampling error within the tolerance in this view. `context` receives the resampling error of
/// the choice. Throws UserError for renderers that draw on the sensor.
KeyframeSampling decide_supersampling(const KeyframeSampling& options, const RenderRequest& view,
                                      SamplingContext& context, Renderer& sensor, const MakeRenderer& make_renderer);

}  // namespace esim::inline sampling
