#pragma once

#include <memory>

#include "esim/sampling/context.h"
#include "esim/sampling/options.h"
#include "esim/sampling/sampler.h"

namespace esim::inline sampling {

/// Samples each tile of the image at its own times, as densely as the measured errors require.
///
/// A tile is sampled again when its motion field, or that of a tile whose content may enter it, has moved the image by
/// max_motion_px, or when the errors at its last samples predict an error equal to the tolerance, whichever comes
/// first. Each sample also checks the interpolation between its neighbours. If these checks predict an error above the
/// tolerance for an interval, the interval is bisected; otherwise its segments are passed on, one sample later. Audits
/// of randomly chosen intervals measure the true error: this error is reported, and it corrects the error that the
/// checks predict.
std::unique_ptr<Sampler> make_adaptive_sampler(const AdaptiveSampling& options, const SamplingContext& context);

}  // namespace esim::inline sampling
