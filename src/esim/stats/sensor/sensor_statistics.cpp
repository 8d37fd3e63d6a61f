#include "esim/stats/sensor/sensor_statistics.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "esim/core/error.h"

namespace esim::inline stats {
namespace {

constexpr TimeNs kSupport_us = kSupport / kNsPerUs;

constexpr std::array<std::string_view, SensorStatistics::kFanoBins_us.size()> kFanoNames{
    "Fano factor, 100 us", "Fano factor, 1 ms", "Fano factor, 10 ms", "Fano factor, 100 ms"};

}  // namespace

SensorStatisticsCounter::SensorStatisticsCounter(std::optional<SensorSize> sensor) : pixels_(sensor) {
  for (const std::int64_t bin_us : SensorStatistics::kFanoBins_us) fano_.emplace_back(bin_us);
}

bool SensorStatisticsCounter::is_supported(const Event& event, TimeNs us) const {
  const SensorSize size = pixels_.size();
  for (int y = std::max(0, event.y - 1); y <= std::min(size.height - 1, event.y + 1); ++y) {
    for (int x = std::max(0, event.x - 1); x <= std::min(size.width - 1, event.x + 1); ++x) {
      if (x == event.x && y == event.y) continue;
      const Pixel& neighbour = pixels_.at(x, y);
      if (neighbour.polarity != 0 && us - neighbour.last <= kSupport_us) return true;
    }
  }
  return false;
}

void SensorStatisticsCounter::add(EventSpan events) {
  SensorStatistics& s = statistics_;
  for (const Event& event : events) {
    if (s.events == 0) first_ = last_ = event.t;
    if (event.t < last_) throw InternalError("an event is earlier than the previous one");
    last_ = event.t;
    Pixel& pixel = pixels_(event);
    const TimeNs us = (event.t - first_ + kNsPerUs / 2) / kNsPerUs;
    const bool on = event.polarity > 0;
    const auto polarity = static_cast<std::int8_t>(on ? 1 : -1);
    ++s.events;
    s.on += on;
    coincidences_.add(us, event.x, event.y);
    for (Fano& fano : fano_) fano.add(us);
    stamps_.add({event.t, event.x});
    if (pixel.polarity != 0) {
      s.intervals_us.add(static_cast<std::uint64_t>(us - pixel.last));
      ++s.pairs;
      s.alike += pixel.polarity == polarity;
    }
    pixel.supported += is_supported(event, us);
    pixel.last = us;
    pixel.polarity = polarity;
    pixel.on += on;
    pixel.off += !on;
  }
}

SensorStatistics SensorStatisticsCounter::finish() && {
  SensorStatistics s = std::move(statistics_);
  s.sensor = pixels_.size();
  s.duration_s = to_seconds(last_ - first_);
  s.same_us = coincidences_.same_us();
  s.after = coincidences_.after();
  for (std::size_t i = 0; i < fano_.size(); ++i) s.fano[i] = fano_[i].factor();
  constexpr int kSize = BlockCounts::kSize;
  Image<BlockCounts> blocks((s.sensor.width + kSize - 1) / kSize, (s.sensor.height + kSize - 1) / kSize);
  for (int y = 0; y < s.sensor.height; ++y) {
    for (int x = 0; x < s.sensor.width; ++x) {
      const Pixel& pixel = pixels_.at(x, y);
      s.counts_on.add(pixel.on);
      s.counts_off.add(pixel.off);
      BlockCounts& block = blocks(x / kSize, y / kSize);
      block.events += pixel.on + pixel.off;
      block.supported += pixel.supported;
    }
  }
  s.quiet = find_quiet_areas(blocks, s.sensor.width, s.sensor.height, s.duration_s);
  s.scan = find_scan(stamps_.items(), s.sensor.width);
  return s;
}

std::vector<NamedValue> values_of(const SensorStatistics& s) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const auto interval_s = [&](double fraction) { return 1e-6 * s.intervals_us.quantile(fraction); };
  std::vector<NamedValue> values{
      {"events", "", static_cast<double>(s.events)},
      {"ON fraction", "", s.on_fraction()},
      {"same row, same us, over chance", "", s.same_us.row_over_chance(s.sensor.height)},
      {"same row, 1 to 5 us later, over chance", "", s.after.row_over_chance(s.sensor.height)},
      {"same column, same us, over chance", "", s.same_us.column_over_chance(s.sensor.width)},
      {"same column, 1 to 5 us later, over chance", "", s.after.column_over_chance(s.sensor.width)},
      {"1 % of the intervals", "s", interval_s(0.01)},
      {"10 % of the intervals", "s", interval_s(0.1)},
      {"50 % of the intervals", "s", interval_s(0.5)},
      {"intervals below 100 us", "", s.intervals_us.fraction_below(100)},
      {"next event of the same polarity", "", s.alike_fraction()},
      {"rate in quiet areas", "Hz", s.quiet.rate_hz},
      {"period of the scan", "s", s.scan ? s.scan->period_s : kNaN},
      {"concentration of the scan", "", s.scan ? s.scan->concentration : kNaN},
  };
  for (std::size_t i = 0; i < kFanoNames.size(); ++i) values.push_back({kFanoNames[i], "", s.fano[i]});
  return values;
}

SensorComparison compare(const SensorStatistics& first, const SensorStatistics& second) {
  SensorComparison comparison;
  const std::vector<NamedValue> a = values_of(first), b = values_of(second);
  for (std::size_t i = 0; i < a.size(); ++i)
    comparison.values.push_back({a[i].name, a[i].unit, a[i].value, b[i].value});
  comparison.ks_counts_on = ks_distance(first.counts_on, second.counts_on);
  comparison.ks_counts_off = ks_distance(first.counts_off, second.counts_off);
  comparison.ks_intervals = ks_distance(first.intervals_us, second.intervals_us);
  return comparison;
}

}  // namespace esim::inline stats
