#pragma once

#include <memory>

#include "esim/reproject/keyframe.h"
#include "esim/sampling/context.h"
#include "esim/sampling/options.h"
#include "esim/sampling/sampler.h"

namespace esim {

/// Whole images of a denser, slightly wider camera at few times, and between them reconstructions by reprojection so
/// often that hardly a pixel moves by more than lambda from one to the next, at most 50000 times per second. A keyframe
/// follows when the image is expected to have moved by max_displacement_px. Two keyframes that do not agree on what
/// lies between them, that leave more than a hundredth of it unseen, or between which the image has moved by more than
/// twice that, get a third one in the middle, again and again, down to 1 / max_rate_hz.
///
/// Needs the context's camera, renderer and view_at. Throws UserError for renderers that draw on the sensor.
std::unique_ptr<Sampler> make_keyframe_sampler(const KeyframeSampling& options, const SamplingContext& context);

/// The keyframes' camera. Where the options leave it open, 2 x 2 pixels to one of the sensor's for tolerances from a
/// quarter of a threshold on, 3 x 3 below: resampling has a floor that no number of keyframes lowers.
KeyframeLayout lay_out_keyframes(const KeyframeSampling& options, const SamplingContext& context);

}  // namespace esim
