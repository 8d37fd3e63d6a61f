#pragma once

#include <memory>

#include "esim/sampling/context.h"
#include "esim/sampling/options.h"
#include "esim/sampling/sampler.h"

namespace esim::inline sampling {

/// Requests a few images (keyframes) of a denser, slightly wider camera, whose renderer it owns, and reconstructs the
/// sensor's images between them by reprojection: often enough that hardly any pixel moves by more than lambda between
/// two images, but at most 50000 times per second. The next keyframe follows when the image is expected to have moved
/// by max_displacement_px. A third keyframe is rendered in the middle between two keyframes if their predictions differ
/// by more than the tolerance, if more than 1 % of the image is hidden from both, or if the image has moved by more
/// than twice max_displacement_px. This repeats down to intervals of 1 / max_rate_hz.
///
/// The first of every six intervals between keyframes is audited: the sensor's own image at a random time in the
/// interval is compared with the segments.
///
/// Renders a few images of the view at the start, to measure the resampling error. Throws UserError if `scene` is null,
/// for colour filters, and for renderers that draw on the sensor.
std::unique_ptr<Sampler> make_keyframe_sampler(const KeyframeSampling& options, const SamplingContext& context,
                                               const SceneAccess* scene);

}  // namespace esim::inline sampling
