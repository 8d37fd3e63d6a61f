#pragma once

#include <memory>

#include "esim/sampling/context.h"
#include "esim/sampling/options.h"
#include "esim/sampling/sampler.h"

namespace esim {

/// Samples each tile of the image at times of its own: as densely as the errors that it measures ask for.
///
/// A tile's next sample lies where its motion field, or that of a tile whose content may come in, has moved by
/// max_motion_px, or where the errors at its last samples let expect an error of the tolerance, whichever comes first.
/// Each sample is also a check of what was known without it: of the interpolation between its neighbours. An interval
/// whose error, as far as these checks tell, is above the tolerance is bisected; what is below goes to the pixels, one
/// sample behind. At some intervals, chosen at random, an audit then looks at what the error really was: that is the
/// error that is reported, and it corrects what is inferred from the checks.
std::unique_ptr<Sampler> make_adaptive_sampler(const AdaptiveSampling& options, const SamplingContext& context);

}  // namespace esim
