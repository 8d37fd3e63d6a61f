#pragma once

#include <memory>

#include "esim/reproject/keyframe.h"
#include "esim/sampling/context.h"
#include "esim/sampling/options.h"
#include "esim/sampling/sampler.h"

namespace esim::inline sampling {

/// Renders a few images (keyframes) with a denser, slightly wider camera and reconstructs the images between them by
/// reprojection: often enough that hardly any pixel moves by more than lambda between two images, but at most 50000
/// times per second. The next keyframe follows when the image is expected to have moved by max_displacement_px. A third
/// keyframe is rendered in the middle between two keyframes if their predictions differ by more than the tolerance, if
/// more than 1 % of the image is hidden from both, or if the image has moved by more than twice max_displacement_px.
/// This repeats down to intervals of 1 / max_rate_hz.
///
/// The first of every six intervals between keyframes is audited: the sensor's own image at a random time in the
/// interval is compared with the segments.
///
/// Requires the context's camera, renderer and view_at. Throws UserError for renderers that draw on the sensor.
std::unique_ptr<Sampler> make_keyframe_sampler(const KeyframeSampling& options, const SamplingContext& context);

/// Range of the automatic choice of the supersampling.
constexpr int kLeastSupersampling = 2, kMostSupersampling = 4;

/// The keyframes' camera. Throws UserError for renderers that draw on the sensor.
KeyframeLayout lay_out_keyframes(const KeyframeSampling& options, const SamplingContext& context);

}  // namespace esim::inline sampling
