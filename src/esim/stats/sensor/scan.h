#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "esim/core/time.h"

namespace esim::inline stats {

/// The time stamp of an event, and its column.
struct ColumnStamp {
  TimeNs t = 0;
  std::uint16_t x = 0;
};

/// A readout that scans the columns: their time stamps repeat with one period, each column with its own phase.
struct Scan {
  double period_s = 0;
  /// How well the column determines the phase of the time stamps: the root of the mean of cos(phase - phase') over all
  /// pairs of events in the same column. 1: exactly, as in a scan. 0: not at all. It does not depend on the number of
  /// events.
  double concentration = 0;
  std::vector<double> column_phases;  ///< mean phase of each column, in periods from 0 to 1; NaN without events
};

/// Searches the time stamps of the column with the most events for a period of 20 us to 1 ms, as find_periodicity()
/// does, and then the phases of all columns at that period. `stamps` must be in order of time. Nothing if there is no
/// such period, or if that column has fewer than 100 events.
std::optional<Scan> find_scan(std::span<const ColumnStamp> stamps, int width);

}  // namespace esim::inline stats
