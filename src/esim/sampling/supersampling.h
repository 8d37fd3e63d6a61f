#pragma once

#include <functional>
#include <memory>

#include "esim/reproject/keyframe.h"
#include "esim/sampling/context.h"
#include "esim/sampling/options.h"

namespace esim {

/// Makes a renderer of the scene for a camera.
using MakeRenderer = std::function<std::unique_ptr<Renderer>(const Camera&)>;

/// What remains of the error of brightness however near a keyframe is: a keyframe of this view, looked up halfway
/// between its pixels, where that is worst, against the sensor's own image. Renders both.
MeasuredError measure_resampling_floor(const KeyframeLayout& layout, RenderRequest request,
                                       const SamplingContext& context, Renderer& sensor, Renderer& keyframes);

/// The same options with everything decided. Where they leave the supersampling open, it is the least one from 2 to 4
/// of which 99 % of the pixels have a resampling floor, in this view, within the tolerance. `context` gets the floor of
/// what was chosen. Throws UserError for renderers that draw on the sensor.
KeyframeSampling decide_supersampling(const KeyframeSampling& options, const RenderRequest& view,
                                      SamplingContext& context, Renderer& sensor, const MakeRenderer& make_renderer);

}  // namespace esim
