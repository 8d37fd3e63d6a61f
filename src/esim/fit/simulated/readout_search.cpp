#include "esim/fit/simulated/readout_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "esim/compare/likeness.h"

namespace esim::inline fit {
namespace {

constexpr std::array kShaped{kRowSameUs, kRowLater, kColumnSameUs, kEventsPerStamp};
constexpr double kCap = 20;         // of the deviations of one statistic
constexpr double kClear = 4;        // a sum of deviations lower by this is better
constexpr double kAsGood = 2;       // a sum higher by at most this belongs to the interval: two standard deviations
constexpr double kFinest_us = 0.1;  // finer time stamps are not rounded
constexpr double kClearScan = 0.9;  // concentration
constexpr double kFullest = 0.95;   // fraction of the time in which the arbiter reads rows

const std::vector<double> kRounds_us{0.2, 1, 4, 10, 20, 40}, kTimes_us{0, 0.1, 0.2, 0.4, 0.8},
    kRests_us{0, 2.5, 4, 5, 5.5, 6, 8, 12, 20};

}  // namespace

double ReadoutSearch::sum_of_deviations(const EventCameraOptions& sensor) const {
  double sum = 0;
  for (const ComparedStatistic& s : compare_sensors(real_, simulate_(sensor))) {
    if (std::find(kShaped.begin(), kShaped.end(), s.name) == kShaped.end()) continue;
    if (!std::isnan(s.deviations)) sum += std::min(kCap, s.deviations);
  }
  return sum;
}

void ReadoutSearch::put(EventCameraOptions& sensor, const Rows& rows) const {
  sensor.readout.row_scan_us = rows.round / real_.sensor.height;
  sensor.readout.row_time_us = rows.time;
  sensor.readout.row_rest_us = rows.rest;
}

double ReadoutSearch::sum_of_deviations(EventCameraOptions sensor, const Rows& rows) const {
  put(sensor, rows);
  return sum_of_deviations(sensor);
}

void ReadoutSearch::unknown(const char* name, std::string why) {
  estimates_.push_back(Estimate::unknown(std::string("readout.") + name, "us", std::move(why)));
}

/// Replaces a time by each of the values, and keeps the best.
void ReadoutSearch::try_values(const EventCameraOptions& sensor, Axis& axis, const std::vector<double>& values) {
  const double present = rows_.*axis.time;
  axis.tried.clear();
  axis.tried.emplace_back(present, best_);
  Rows best = rows_;
  for (const double value : values) {
    if (value == present) continue;
    Rows changed = rows_;
    changed.*axis.time = value;
    const double sum = sum_of_deviations(sensor, changed);
    axis.tried.emplace_back(value, sum);
    if (sum < best_) best_ = sum, best = changed;
  }
  rows_ = best;
}

void ReadoutSearch::search_rows(const EventCameraOptions& sensor) {
  const double rate_per_us = 1e-6 * static_cast<double>(real_.events) / real_.duration_s;
  std::vector<double> times = kTimes_us;
  std::erase_if(times, [&](double time) { return time * rate_per_us > kFullest; });
  // Round and time act alike, so that their minimum is looked for together.
  best_ = std::numeric_limits<double>::infinity();
  for (const double round : kRounds_us) {
    for (const double time : times) {
      const Rows rows{round, time, 0};
      const double sum = sum_of_deviations(sensor, rows);
      if (sum < best_) best_ = sum, rows_ = rows;
    }
  }
  std::array axes{Axis{&Rows::rest, kRests_us}, Axis{&Rows::round, {}}, Axis{&Rows::time, {}}};
  try_values(sensor, axes[0], kRests_us);
  for (const std::size_t i : {1U, 2U, 0U}) {  // finer, around the best
    const double middle = std::max(rows_.*axes[i].time, i == 2 ? 0.05 : 0.5);
    try_values(sensor, axes[i], {0, middle / 2, middle / 1.25, middle * 1.25, middle * 2});
  }
  const double scan = 1.0 / real_.sensor.height;
  report("row_scan_us", axes[1], scan);
  report("row_time_us", axes[2], 1);
  report("row_rest_us", axes[0], 1);
}

/// The interval ends at the values next to those that are as good as the best. Where 0 is as good, it is chosen.
void ReadoutSearch::report(const char* name, Axis axis, double scale) {
  std::sort(axis.tried.begin(), axis.tried.end());
  const auto as_good = [&](const auto& tried) { return tried.second <= best_ + kAsGood; };
  const auto first = std::find_if(axis.tried.begin(), axis.tried.end(), as_good);
  const auto last = std::find_if(axis.tried.rbegin(), axis.tried.rend(), as_good);
  if (first->first == 0) rows_.*axis.time = 0;
  if (last == axis.tried.rbegin())
    return unknown(name, fmt::format("values up to {:.3g} us are as good", scale * axis.tried.back().first));
  const double low = first == axis.tried.begin() ? 0 : std::prev(first)->first, high = std::prev(last)->first;
  estimates_.push_back(Estimate::found(std::string("readout.") + name, "us", scale * rows_.*axis.time, scale * low,
                                       scale * high, "rows that share time stamps, by simulation of the scene"));
}

void ReadoutSearch::run(EventCameraOptions& sensor) {
  if (!sensor.circuit) {
    for (const char* name : {"time_stamp_us", "row_scan_us", "row_rest_us", "row_time_us"})
      unknown(name, "the base has no circuit");
    return;
  }
  ReadoutOptions& readout = sensor.readout;
  const double unit_us = 1e-3 * static_cast<double>(real_.stamp_unit), stamp_us = unit_us >= kFinest_us ? unit_us : 0;
  estimates_.push_back(
      Estimate::found("readout.time_stamp_us", "us", stamp_us, stamp_us, stamp_us, "largest common divisor"));
  const double rate_mev_per_s = readout.rate_mev_per_s;
  if (real_.scan && real_.scan->concentration > kClearScan) {
    const double period_us = 1e6 * real_.scan->period_s;
    readout = {}, readout.scan_period_us = period_us;
    estimates_.push_back(
        Estimate::found("readout.scan_period_us", "us", period_us, period_us, period_us, "time stamps of the columns"));
    return;
  }
  readout.scan_period_us = 0, readout.time_stamp_us = stamp_us;
  EventCameraOptions none = sensor;
  none.readout = {}, none.readout.time_stamp_us = stamp_us, none.readout.rate_mev_per_s = rate_mev_per_s;
  const double given = sum_of_deviations(sensor), without = sum_of_deviations(none);
  const std::size_t known = estimates_.size();
  search_rows(none);
  if (best_ <= std::min(given, without) - kClear) {
    put(sensor, rows_);
    return;
  }
  estimates_.resize(known);
  const bool removed = without <= given - kClear;
  if (removed) sensor = none;
  for (const char* name : {"row_scan_us", "row_rest_us", "row_time_us"}) {
    unknown(name, removed ? "rows share no time stamps; there is no arbiter of rows then"
                          : "no readout of rows agrees clearly better with the time stamps than that of the base");
  }
}

}  // namespace esim::inline fit
