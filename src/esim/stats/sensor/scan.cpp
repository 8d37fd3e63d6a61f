#include "esim/stats/sensor/scan.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "esim/stats/periodicity.h"

namespace esim::inline stats {
namespace {

constexpr FrequencyRange kScans{1e3, 5e4};

/// The phase of a time, in periods. The whole periods are removed in extended precision.
double phase_of(TimeNs t, double frequency_hz) {
  const long double periods = static_cast<long double>(t) * 1e-9L * static_cast<long double>(frequency_hz);
  return static_cast<double>(periods - std::floor(periods));
}

}  // namespace

std::optional<Scan> find_scan(std::span<const ColumnStamp> stamps, int width) {
  if (stamps.empty()) return std::nullopt;
  std::vector<double> counts(static_cast<std::size_t>(width));
  for (const ColumnStamp& stamp : stamps) counts[stamp.x] += 1;
  const auto fullest = std::max_element(counts.begin(), counts.end()) - counts.begin();
  std::vector<TimeNs> times;
  for (const ColumnStamp& stamp : stamps) {
    if (stamp.x == fullest) times.push_back(stamp.t);
  }
  const std::optional<Periodicity> period = find_periodicity(times, kScans);
  if (!period || !period->found()) return std::nullopt;

  std::vector<std::complex<double>> sums(counts.size());
  for (const ColumnStamp& stamp : stamps) {
    const double phase = phase_of(stamp.t - stamps.front().t, period->frequency_hz);
    sums[stamp.x] += std::polar(1.0, 2 * std::numbers::pi * phase);
  }
  Scan scan;
  scan.period_s = 1 / period->frequency_hz;
  double aligned = 0, pairs = 0;
  for (std::size_t x = 0; x < sums.size(); ++x) {
    aligned += std::norm(sums[x]) - counts[x];
    pairs += counts[x] * (counts[x] - 1);
    const double turns = std::arg(sums[x]) / (2 * std::numbers::pi);
    scan.column_phases.push_back(counts[x] > 0 ? turns - std::floor(turns) : std::numeric_limits<double>::quiet_NaN());
  }
  scan.concentration = std::sqrt(std::max(0.0, aligned / pairs));
  return scan;
}

}  // namespace esim::inline stats
