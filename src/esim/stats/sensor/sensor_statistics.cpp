#include "esim/stats/sensor/sensor_statistics.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <utility>

#include "esim/core/error.h"

namespace esim::inline stats {
namespace {

constexpr TimeNs kSupport_us = kSupport / kNsPerUs;

constexpr std::array<std::string_view, kFanoBins_us.size()> kFanoNames{"Fano factor, 100 us", "Fano factor, 1 ms",
                                                                       "Fano factor, 10 ms", "Fano factor, 100 ms"};

}  // namespace

SensorStatisticsCounter::SensorStatisticsCounter(std::optional<SensorSize> sensor) : pixels_(sensor) {
  for (const std::int64_t bin_us : kFanoBins_us) fano_.emplace_back(bin_us);
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
  for (const Event& event : events) {
    const bool first = !std::exchange(any_, true);
    if (first) first_ = last_ = event.t;
    if (event.t < last_) throw InternalError("an event is earlier than the previous one");
    Pixel& pixel = pixels_(event);
    const TimeNs us = (event.t - first_ + kNsPerUs / 2) / kNsPerUs;
    const bool on = event.polarity > 0;
    const auto polarity = static_cast<std::int8_t>(on ? 1 : -1);
    StreamSums& sums = blocks_.at(us);
    ++sums.events;
    sums.on += on;
    sums.stamps += first || event.t != last_;
    if (event.t != last_) unit_ = std::gcd(unit_, event.t - last_);
    last_ = event.t;
    coincidences_.add(us, event.x, event.y, sums.same_us, sums.after);
    row_pairs_.add(us, event.y);
    for (std::size_t i = 0; i < fano_.size(); ++i) fano_[i].add(us, sums.fano[i]);
    stamps_.add({event.t, event.x});
    if (pixel.polarity != 0) {
      sums.intervals_us.add(static_cast<std::uint64_t>(us - pixel.last));
      ++sums.pairs;
      sums.alike += pixel.polarity == polarity;
    }
    pixel.supported += is_supported(event, us);
    pixel.last = us;
    pixel.polarity = polarity;
    pixel.on += on;
    pixel.off += !on;
  }
}

void SensorStatisticsCounter::count_pixels(SensorStatistics& s) const {
  constexpr int kSize = BlockCounts::kSize, kTiles = static_cast<int>(SensorStatistics::kTiles);
  const auto [width, height] = s.sensor;
  Image<BlockCounts> blocks((width + kSize - 1) / kSize, (height + kSize - 1) / kSize);
  s.tiles.resize(SensorStatistics::kTiles * SensorStatistics::kTiles);
  const auto events_of = [&](int x, int y) { return static_cast<double>(pixels_.at(x, y).on + pixels_.at(x, y).off); };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Pixel& pixel = pixels_.at(x, y);
      PixelSums& tile = s.tiles[static_cast<std::size_t>(y * kTiles / height * kTiles + x * kTiles / width)];
      tile.counts_on.add(pixel.on);
      tile.counts_off.add(pixel.off);
      if (x + 1 < width) tile.neighbours.add(events_of(x, y), events_of(x + 1, y));
      if (y + 1 < height) tile.neighbours.add(events_of(x, y), events_of(x, y + 1));
      BlockCounts& block = blocks(x / kSize, y / kSize);
      block.events += pixel.on + pixel.off;
      block.supported += pixel.supported;
    }
  }
  for (const PixelSums& tile : s.tiles) s.PixelSums::add(tile);
  s.quiet = find_quiet_areas(blocks, width, height, s.duration_s);
}

SensorStatistics SensorStatisticsCounter::finish() && {
  SensorStatistics s;
  s.sensor = pixels_.size();
  s.duration_s = to_seconds(last_ - first_);
  s.stamp_unit = unit_;
  s.block_s = blocks_.length_s();
  s.blocks = std::move(blocks_).take();
  for (const StreamSums& block : s.blocks) s.StreamSums::add(block);
  count_pixels(s);
  s.scan = find_scan(stamps_.items(), s.sensor.width);
  s.row_wait = row_pairs_.wait();
  return s;
}

std::vector<NamedValue> values_of(const SensorStatistics& s) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const auto interval_s = [&](double fraction) { return 1e-6 * s.intervals_us.quantile(fraction); };
  using enum Comparison;
  std::vector<NamedValue> values{
      {kEventRate, "1/s", ratio, s.duration_s > 0 ? static_cast<double>(s.events) / s.duration_s : kNaN},
      {kOnFraction, "", difference, s.on_fraction()},
      {kRowSameUs, "", difference, s.same_us.row_over_chance(s.sensor.height)},
      {kRowLater, "", difference, s.after.row_over_chance(s.sensor.height)},
      {kColumnSameUs, "", difference, s.same_us.column_over_chance(s.sensor.width)},
      {kColumnLater, "", difference, s.after.column_over_chance(s.sensor.width)},
      {kShortIntervals, "s", ratio, interval_s(0.01)},
      {"10 % of the intervals", "s", ratio, interval_s(0.1)},
      {"50 % of the intervals", "s", ratio, interval_s(0.5)},
      {"intervals below 100 us", "", difference, s.intervals_us.fraction_below(100)},
      {"next event of the same polarity", "", difference, s.alike_fraction()},
      {"rate in quiet areas", "Hz", difference, s.quiet.rate_hz()},
      {"correlation of neighbouring pixels", "", difference, s.neighbours.value()},
      {kEventsPerStamp, "", ratio, s.events_per_stamp()},
      {"unit of time stamps", "s", ratio, s.stamp_unit > 0 ? to_seconds(s.stamp_unit) : kNaN},
      {kScanPeriod, "s", ratio, s.scan ? s.scan->period_s : kNaN},
      {"concentration of the scan", "", difference, s.scan ? s.scan->concentration : kNaN},
  };
  for (std::size_t i = 0; i < kFanoNames.size(); ++i) values.push_back({kFanoNames[i], "", ratio, s.fano[i].factor()});
  return values;
}

}  // namespace esim::inline stats
