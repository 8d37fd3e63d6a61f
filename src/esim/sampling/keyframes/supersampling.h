#pragma once

#include <memory>

#include "esim/reproject/keyframe.h"
#include "esim/sampling/context.h"
#include "esim/sampling/keyframes/keyframe_renderer.h"
#include "esim/sampling/measured_error.h"
#include "esim/sampling/options.h"

namespace esim::inline sampling {

/// Range of the automatic choice of the supersampling.
constexpr int kMinSupersampling = 2, kMaxSupersampling = 4;

/// The camera of keyframes, and its renderer.
struct KeyframeSetup {
  KeyframeLayout layout;
  std::unique_ptr<KeyframeRenderer> renderer;
  SceneParts parts;

  /// The error of brightness that remains even if a keyframe is at the sensor's own view: a keyframe of the view at the
  /// start is interpolated halfway between its pixels, where the error is largest, and compared with the sensor's own
  /// image.
  MeasuredError resampling_error;
};

/// Makes the camera of keyframes, and renders to measure its resampling error. If the supersampling in `options` is 0,
/// it is the smallest from 2 to 4 for which 99 % of the pixels have a resampling error within the tolerance.
KeyframeSetup set_up_keyframes(const KeyframeSampling& options, const SamplingContext& context,
                               const SceneAccess& scene);

}  // namespace esim::inline sampling
