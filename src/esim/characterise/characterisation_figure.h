#pragma once

#include <vector>

#include "esim/characterise/characterisation.h"
#include "esim/core/image.h"
#include "esim/plot/colour.h"

namespace esim::inline characterise {

/// One or two sensors as a figure with four panels: S-curves in the brightest light, and latency, bandwidth and
/// background rate by illuminance.
Image<Rgb> draw_characterisation(const std::vector<Characterisation>& sensors);

}  // namespace esim::inline characterise
