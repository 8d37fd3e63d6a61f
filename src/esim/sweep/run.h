#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "esim/compose/compose.h"
#include "esim/sweep/plan.h"

namespace esim::inline sweep {

/// The events of one sensor in one run, as statistics. Rates are those of stats::Statistics.
struct SweepRow {
  std::size_t run = 0;
  std::filesystem::path folder{};  ///< of the events, in that of the sweep
  std::uint64_t events = 0;
  double on_fraction = 0;        ///< NaN without events
  double mean_rate_hz = 0;       ///< of all pixels
  double rate_per_pixel_hz = 0;  ///< mean
  double interval_min_s = 0;     ///< between events of a pixel, as the next three; NaN without intervals
  double interval_1_percent_s = 0, interval_median_s = 0, interval_99_percent_s = 0;
  double real_time_factor = 0;  ///< of the simulation, which may be that of several runs
};

struct SweepProgress {
  std::size_t complete = 0, all = 0;  ///< simulations
  double fraction = 0;                ///< of the simulations that this call makes
  std::int64_t events = 0;            ///< of the same
};

/// What run_sweep() calls, from one thread at a time.
struct SweepMonitor {
  Notices notices{};  ///< each text once

  /// Called often. Returning false ends the sweep; simulations that are not complete will be made again.
  std::function<bool(const SweepProgress&)> progress{};

  /// Called when a simulation has become complete.
  std::function<void(const SweptSimulation&, const Summary&, const SweepProgress&)> made{};
};

struct SweepWork {
  std::filesystem::path folder{};
  int jobs = 1;             ///< simulations at the same time
  int threads = 0;          ///< of each; 0: every processor
  Repetition repetition{};  ///< for reports
};

/// Makes the simulations of a sweep that are not complete in its folder yet, and the statistics of all. Empty if it was
/// ended early. The folder, which begin_or_continue() has prepared, gets a recording for each simulation. Throws
/// UserError if a simulation fails; complete ones are kept.
std::optional<std::vector<SweepRow>> run_sweep(const SweepPlan& plan, const SweepWork& work,
                                               const SweepMonitor& monitor);

/// The number of simulations that are complete in the folder.
std::size_t complete_simulations(const SweepPlan& plan, const std::filesystem::path& folder);

}  // namespace esim::inline sweep
