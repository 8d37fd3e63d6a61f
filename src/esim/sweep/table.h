#pragma once

#include <optional>
#include <string>
#include <vector>

#include "esim/core/image.h"
#include "esim/plot/colour.h"
#include "esim/sweep/run.h"

namespace esim::inline sweep {

/// The results as CSV, one row for each run and sensor, in SI units; empty cells for values that are undefined.
std::string to_csv(const SweepPlan& plan, const std::vector<SweepRow>& rows);

/// The main results as an aligned table for a terminal.
std::string describe(const SweepPlan& plan, const std::vector<SweepRow>& rows);

/// The mean rate over each option whose values are numbers, except seeds: one diagram for each, with a curve for each
/// combination of the other options and of the sensors. Empty if there is no such option.
std::optional<Image<Rgb>> draw_rates(const SweepPlan& plan, const std::vector<SweepRow>& rows);

}  // namespace esim::inline sweep
