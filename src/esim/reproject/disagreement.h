#pragma once

#include "esim/reproject/reprojector.h"

namespace esim::inline reproject {

/// Difference between the predictions of an image by the two keyframes around it: the 99.8th percentile, over blocks of
/// 8 x 8 pixels, of |mean of L_before - L_after|. Both keyframes must see at least a quarter of a block. The mean
/// removes the effects of resampling and edges on single pixels, and keeps changes over an area: lighting, shadows,
/// reflections.
double disagreement(const Reconstruction& apart, double log_eps);

}  // namespace esim::inline reproject
