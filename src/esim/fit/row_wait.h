#pragma once

#include <optional>

#include "esim/fit/estimate.h"
#include "esim/stats/sensor/sensor_statistics.h"

// Private to fit.
namespace esim::inline fit {

/// readout.row_wait_us, from the pairs of events of a row that are missing shortly after each other
/// (docs/methods/fitting.md, section 3). Nothing if none are clearly missing, or if there are too few.
std::optional<Estimate> find_row_wait(const SensorStatistics& recording);

}  // namespace esim::inline fit
