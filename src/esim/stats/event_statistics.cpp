#include "esim/stats/event_statistics.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <utility>

#include "esim/core/error.h"

namespace esim::inline stats {
namespace {

constexpr std::int64_t kMaxPixels = std::int64_t{1} << 26;

void require_bearable(std::int64_t width, std::int64_t height) {
  if (width * height <= kMaxPixels) return;
  throw UserError(fmt::format(
      "a sensor of {} x {} px is too large for statistics, which support at most {} million pixels; check the "
      "coordinates of the events",
      width, height, kMaxPixels >> 20));
}

}  // namespace

Banding Statistics::banding() const {
  if (!phase) return Banding::unknown;
  return periodicity && !periodicity->found() ? Banding::none : phase->banding;
}

EventStatistics::EventStatistics(std::optional<SensorSize> sensor) : grows_(!sensor) {
  if (!sensor) return;
  require_bearable(sensor->width, sensor->height);
  statistics_.sensor = *sensor;
  pixels_ = Image<Pixel>(sensor->width, sensor->height);
}

void EventStatistics::make_room(const Event& event) {
  if (!grows_) throw InternalError("an event is outside the sensor");
  SensorSize& sensor = statistics_.sensor;
  sensor.width = std::max(sensor.width, event.x + 1);
  sensor.height = std::max(sensor.height, event.y + 1);
  if (event.x < pixels_.width() && event.y < pixels_.height()) return;
  require_bearable(sensor.width, sensor.height);
  Image<Pixel> larger(std::max(sensor.width, pixels_.width() * 3 / 2),
                      std::max(sensor.height, pixels_.height() * 3 / 2));
  for (int y = 0; y < pixels_.height(); ++y) std::copy_n(pixels_.row(y), pixels_.width(), larger.row(y));
  pixels_ = std::move(larger);
}

void EventStatistics::count_stamp(TimeNs t) {
  Statistics& s = statistics_;
  if (t == s.last && s.events() > 0) {
    ++same_time_;
    s.simultaneous += same_time_ == 2 ? 2 : 1;
  } else {
    if (s.events() == 0) s.first = t;
    if (t < s.last && s.events() > 0) throw InternalError("an event is earlier than the previous one");
    ++s.distinct_times;
    same_time_ = 1;
  }
  s.last = t;
  s.max_simultaneous = std::max(s.max_simultaneous, same_time_);
}

void EventStatistics::add(EventSpan events) {
  Statistics& s = statistics_;
  for (const Event& event : events) {
    if (event.x >= s.sensor.width || event.y >= s.sensor.height) make_room(event);
    count_stamp(event.t);
    const bool on = event.polarity > 0;  // no branch: the polarity cannot be predicted
    s.on += on;
    s.off += !on;
    s.rate.add(event.t - s.first, on);
    sample_.add(event.t);
    Pixel& pixel = pixels_(event.x, event.y);
    if ((pixel.on | pixel.off) != 0) s.intervals.add(event.t - pixel.last_t);
    pixel.last_t = event.t;
    pixel.on += on;
    pixel.off += !on;
  }
}

Statistics EventStatistics::finish(const StatisticsOptions& options) && {
  Statistics s = std::move(statistics_);
  s.rate.finish();
  const int width = s.sensor.width, height = s.sensor.height;
  s.on_counts = s.off_counts = s.counts = Image<std::uint32_t>(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Pixel& pixel = pixels_(x, y);
      s.on_counts(x, y) = pixel.on;
      s.off_counts(x, y) = pixel.off;
      s.counts(x, y) = pixel.on + pixel.off;
      s.largest_count = std::max(s.largest_count, s.counts(x, y));
      s.silent_pixels += s.counts(x, y) == 0 ? 1 : 0;
    }
  }
  s.median_count = median_count(s.counts);
  s.hot_pixels = find_hot_pixels(s.counts, options.hot_pixel_sigmas);

  if (!options.frame_rate_hz) s.periodicity = find_periodicity(sample_.times());
  if (options.frame_rate_hz) {
    s.phase = test_phase(sample_.times(), *options.frame_rate_hz);
  } else if (s.periodicity) {
    s.phase = test_phase(sample_.times(), s.periodicity->frequency_hz);
  }
  return s;
}

}  // namespace esim::inline stats
