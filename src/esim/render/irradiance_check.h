#pragma once

#include "esim/render/irradiance_check.h"
#include "esim/render/sample.h"

namespace esim::inline render {

/// Whether all irradiances of the segment's rows are finite numbers >= 0.
bool all_irradiance(const Segment& segment, Rows rows);

/// Throws UserError, naming the first pixel and the time, unless every irradiance of the tile is a finite number >= 0.
void check_irradiance(const Segment& segment);

}  // namespace esim::inline render
