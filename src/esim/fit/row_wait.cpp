#include "esim/fit/row_wait.h"

#include <algorithm>

#include "esim/event_camera/options.h"

namespace esim::inline fit {
namespace {

constexpr double kShortest_us = 1;  // as long as the time stamps' unit
constexpr double kClear = 4;        // standard deviations

}  // namespace

std::optional<Estimate> find_row_wait(const SensorStatistics& recording) {
  const auto [mean_us, deviation_us] = recording.row_wait;
  if (!(mean_us > std::max(kShortest_us, kClear * deviation_us))) return std::nullopt;
  // Without the part that is due to other rows that wait: events per us times the wait, if few share a row.
  const double events_per_us = 1e-6 * static_cast<double>(recording.events) / recording.duration_s;
  const auto alone_us = [&](double us) { return us / (1 + events_per_us * us / ReadoutOptions::kRowsOfDoubleWait); };
  const double reach_us = kNormalQuantile * deviation_us;
  return Estimate::found("readout.row_wait_us", "us", alone_us(mean_us), alone_us(mean_us - reach_us),
                         alone_us(mean_us + reach_us), "events of a row that are missing shortly after others");
}

}  // namespace esim::inline fit
