#pragma once

#include "esim/reproject/reprojector.h"

namespace esim {

/// By how much two keyframes disagree on an image between them: |mean of L_before - L_after| over blocks of 8 x 8
/// pixels of which both see at least a quarter, and of those the one that 0.2 % exceed. The mean leaves out what
/// resampling and edges do to single pixels, and keeps what changes over an area: light, shadows, reflections.
double disagreement(const Reconstruction& apart, double log_eps);

}  // namespace esim
