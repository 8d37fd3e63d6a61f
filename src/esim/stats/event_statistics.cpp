#include "esim/stats/event_statistics.h"

#include <algorithm>
#include <utility>

#include "esim/core/error.h"

namespace esim::inline stats {

Banding Statistics::banding() const {
  if (!phase) return Banding::unknown;
  return periodicity && !periodicity->found() ? Banding::none : phase->banding;
}

EventStatistics::EventStatistics(std::optional<SensorSize> sensor) : pixels_(sensor) {}

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
    Pixel& pixel = pixels_(event);
    count_stamp(event.t);
    const bool on = event.polarity > 0;  // no branch: the polarity cannot be predicted
    s.on += on;
    s.off += !on;
    s.rate.add(event.t - s.first, on);
    sample_.add(event.t);
    if ((pixel.on | pixel.off) != 0) s.intervals.add(event.t - pixel.last_t);
    pixel.last_t = event.t;
    pixel.on += on;
    pixel.off += !on;
  }
}

Statistics EventStatistics::finish(const StatisticsOptions& options) && {
  Statistics s = std::move(statistics_);
  s.rate.finish();
  s.sensor = pixels_.size();
  const int width = s.sensor.width, height = s.sensor.height;
  s.on_counts = s.off_counts = s.counts = Image<std::uint32_t>(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Pixel& pixel = pixels_.at(x, y);
      s.on_counts(x, y) = pixel.on;
      s.off_counts(x, y) = pixel.off;
      s.counts(x, y) = pixel.on + pixel.off;
      s.largest_count = std::max(s.largest_count, s.counts(x, y));
      s.silent_pixels += s.counts(x, y) == 0 ? 1 : 0;
    }
  }
  s.median_count = median_count(s.counts);
  s.hot_pixels = find_hot_pixels(s.counts, options.hot_pixel_sigmas);

  if (!options.frame_rate_hz) s.periodicity = find_periodicity(sample_.items());
  if (options.frame_rate_hz) {
    s.phase = test_phase(sample_.items(), *options.frame_rate_hz);
  } else if (s.periodicity) {
    s.phase = test_phase(sample_.items(), s.periodicity->frequency_hz);
  }
  return s;
}

}  // namespace esim::inline stats
