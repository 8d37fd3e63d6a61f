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
/// One interval between keyframes in six, from the first on, is audited: the sensor's own image at a random time in it
/// is compared with what the segments say of that time.
///
/// Needs the context's camera, renderer and view_at. Throws UserError for renderers that draw on the sensor.
std::unique_ptr<Sampler> make_keyframe_sampler(const KeyframeSampling& options, const SamplingContext& context);

/// What is chosen from where the options leave the supersampling open.
constexpr int kLeastSupersampling = 2, kMostSupersampling = 4;

/// The keyframes' camera. Throws UserError for renderers that draw on the sensor.
KeyframeLayout lay_out_keyframes(const KeyframeSampling& options, const SamplingContext& context);

}  // namespace esim
