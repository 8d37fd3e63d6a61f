#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "esim/core/image.h"
#include "esim/events/event.h"
#include "esim/formats/events_file.h"
#include "esim/stats/hot_pixels.h"
#include "esim/stats/interval_histogram.h"
#include "esim/stats/periodicity.h"
#include "esim/stats/pixel_map.h"
#include "esim/stats/rate_curve.h"
#include "esim/stats/stream_sample.h"

namespace esim::inline stats {

/// Statistics of a stream of events. Rates are relative to the time between its first event and its last.
struct Statistics {
  SensorSize sensor;  ///< as given, or just large enough for the events
  std::uint64_t on = 0, off = 0;
  TimeNs first = 0, last = 0;  ///< of the events; undefined without events
  RateCurve rate;

  Image<std::uint32_t> on_counts, off_counts, counts;  ///< events of each pixel: ON, OFF, both
  double median_count = 0;                             ///< median number of events of a pixel
  std::uint32_t largest_count = 0;
  std::uint64_t silent_pixels = 0;  ///< pixels without events
  std::vector<HotPixel> hot_pixels;
  IntervalHistogram intervals;  ///< between consecutive events of the same pixel

  std::uint64_t distinct_times = 0;
  std::uint64_t simultaneous = 0;      ///< events that share their time stamp with another
  std::uint64_t max_simultaneous = 0;  ///< events with the same time stamp

  std::optional<Periodicity> periodicity;  ///< not set if the period was given or cannot be searched for
  std::optional<PhaseTest> phase;          ///< at the given frequency, or that of `periodicity`

  std::uint64_t events() const { return on + off; }
  double duration_s() const { return to_seconds(last - first); }
  double mean_rate_hz() const { return per_second(events()); }
  double per_second(std::uint64_t number) const {
    return last > first ? static_cast<double>(number) / duration_s() : 0.0;
  }
  /// Whether the time stamps prefer phases of the period. A period that was searched for must also have been found.
  Banding banding() const;
};

struct StatisticsOptions {
  double hot_pixel_sigmas = 5;
  std::optional<double> frame_rate_hz;  ///< frequency to test for banding; if not set, it is searched for
};

/// Computes Statistics in one pass, with memory that does not depend on the number of events: 16 bytes per pixel and at
/// most 10 MB. The result does not depend on how the events are divided into portions.
class EventStatistics {
 public:
  /// Without a size, the sensor grows with the events. Throws UserError if it has more than 2^26 pixels.
  explicit EventStatistics(std::optional<SensorSize> sensor = std::nullopt);

  /// Adds events in order of time, within 146 years and on the sensor, as EventsFile delivers them. Throws
  /// InternalError for other events, and UserError if a sensor of unknown size becomes too large.
  void add(EventSpan events);

  /// The statistics of all events; ends the computation.
  Statistics finish(const StatisticsOptions& options = {}) &&;

 private:
  struct Pixel {
    TimeNs last_t = 0;
    std::uint32_t on = 0, off = 0;
  };
  void count_stamp(TimeNs t);

  PixelMap<Pixel> pixels_;
  Statistics statistics_;
  TimeSample sample_;
  std::uint64_t same_time_ = 0;  // events at the last time
};

}  // namespace esim::inline stats
