#include "esim/fit/simulated/readout_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "esim/compare/likeness.h"
#include "esim/fit/row_wait.h"

namespace esim::inline fit {
namespace {

constexpr std::array kShaped{kRowSameUs, kRowLater, kColumnSameUs, kColumnLater, kEventsPerStamp};
constexpr double kCap = 20;           // of the deviations of one statistic
constexpr double kCertain = 4;        // a sum of deviations lower by this is better
constexpr double kAsGood = 2;         // a sum higher by at most this belongs to the interval: two standard deviations
constexpr double kFinest_us = 0.1;    // finer time stamps are not rounded
constexpr double kCertainScan = 0.9;  // concentration
constexpr double kFullest = 0.95;     // fraction of the time in which the arbiter reads rows

const std::vector<double> kTimes_us{0, 0.1, 0.2, 0.4, 0.8}, kCouplings{0, 0.25, 0.5, 0.75, 1};

}  // namespace

double ReadoutSearch::sum_of_deviations(const EventCameraOptions& sensor) const {
  double sum = 0;
  for (const ComparedStatistic& s : compare_sensors(real_, simulate_(sensor))) {
    if (std::find(kShaped.begin(), kShaped.end(), s.name) == kShaped.end()) continue;
    if (!std::isnan(s.deviations)) sum += std::min(kCap, s.deviations);
  }
  return sum;
}

double ReadoutSearch::sum_of_deviations(EventCameraOptions sensor, const ReadoutOptions& readout) const {
  sensor.readout = readout;
  return sum_of_deviations(sensor);
}

void ReadoutSearch::unknown(const char* name, const char* unit, std::string why) {
  estimates_.push_back(Estimate::unknown(std::string("readout.") + name, unit, std::move(why)));
}

/// Replaces an option by each of the values, and keeps the best.
void ReadoutSearch::try_values(const EventCameraOptions& sensor, Axis& axis, const std::vector<double>& values) {
  const double present = rows_.*axis.option;
  axis.tried.clear();
  axis.tried.emplace_back(present, best_);
  ReadoutOptions best = rows_;
  for (const double value : values) {
    if (value == present) continue;
    ReadoutOptions changed = rows_;
    changed.*axis.option = value;
    const double sum = sum_of_deviations(sensor, changed);
    axis.tried.emplace_back(value, sum);
    if (sum < best_) best_ = sum, best = changed;
  }
  rows_ = best;
}

void ReadoutSearch::search_rows(const EventCameraOptions& sensor) {
  rows_ = sensor.readout;
  if (const std::optional<Estimate> wait = find_row_wait(real_)) {
    rows_.row_wait_us = wait->value;
    estimates_.push_back(*wait);
  } else {
    unknown("row_wait_us", "us", "no events of a row are missing shortly after others, or there are too few");
  }
  const double rate_per_us = 1e-6 * static_cast<double>(real_.events) / real_.duration_s;
  std::vector<double> times = kTimes_us;
  std::erase_if(times, [&](double time) { return time * rate_per_us > kFullest; });
  best_ = sum_of_deviations(sensor, rows_);
  Axis coupling{&ReadoutOptions::column_coupling, kCouplings}, time{&ReadoutOptions::row_time_us, times};
  try_values(sensor, time, times);
  try_values(sensor, coupling, kCouplings);
  const double middle = std::max(rows_.row_time_us, 0.05);
  try_values(sensor, time, {0, middle / 2, middle / 1.25, middle * 1.25, middle * 2});
  try_values(sensor, coupling, kCouplings);
  report("row_time_us", "us", time);
  report("column_coupling", "", coupling);
}

/// The interval ends at the values next to those that are as good as the best. Where 0 is as good, it is chosen.
void ReadoutSearch::report(const char* name, const char* unit, Axis axis) {
  std::sort(axis.tried.begin(), axis.tried.end());
  const auto as_good = [&](const auto& tried) { return tried.second <= best_ + kAsGood; };
  const auto first = std::find_if(axis.tried.begin(), axis.tried.end(), as_good);
  const auto last = std::find_if(axis.tried.rbegin(), axis.tried.rend(), as_good);
  if (first->first == 0) rows_.*axis.option = 0;
  const bool may_be_more = last == axis.tried.rbegin(), is_full = axis.option == &ReadoutOptions::column_coupling;
  if (may_be_more && (!is_full || first == axis.tried.begin()))
    return unknown(name, unit, fmt::format("values up to {:.3g} are as good", axis.tried.back().first));
  const double low = first == axis.tried.begin() ? 0 : std::prev(first)->first;
  const double high = may_be_more ? 1 : std::prev(last)->first;
  estimates_.push_back(Estimate::found(std::string("readout.") + name, unit, rows_.*axis.option, low, high,
                                       "rows and columns that share time stamps, by simulation of the scene"));
}

void ReadoutSearch::run(EventCameraOptions& sensor) {
  if (!sensor.circuit) {
    for (const char* name : {"time_stamp_us", "row_wait_us", "row_time_us"})
      unknown(name, "us", "the base has no circuit");
    unknown("column_coupling", "", "the base has no circuit");
    return;
  }
  ReadoutOptions& readout = sensor.readout;
  const double unit_us = 1e-3 * static_cast<double>(real_.stamp_unit), stamp_us = unit_us >= kFinest_us ? unit_us : 0;
  estimates_.push_back(
      Estimate::found("readout.time_stamp_us", "us", stamp_us, stamp_us, stamp_us, "largest common divisor"));
  const double rate_mev_per_s = readout.rate_mev_per_s;
  if (real_.scan && real_.scan->concentration > kCertainScan) {
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
  if (best_ <= std::min(given, without) - kCertain) {
    sensor.readout = rows_;
    return;
  }
  estimates_.resize(known);
  const bool removed = without <= given - kCertain;
  if (removed) sensor = none;
  const char* const why = removed
                              ? "rows share no time stamps; there is no arbiter of rows then"
                              : "no readout of rows agrees clearly better with the time stamps than that of the base";
  for (const char* name : {"row_wait_us", "row_time_us"}) unknown(name, "us", why);
  unknown("column_coupling", "", why);
}

}  // namespace esim::inline fit
