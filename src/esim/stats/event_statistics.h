#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "esim/core/image.h"
#include "esim/events/event.h"
#include "esim/record/events_file.h"
#include "esim/stats/hot_pixels.h"
#include "esim/stats/interval_histogram.h"
#include "esim/stats/periodicity.h"
#include "esim/stats/rate_curve.h"
#include "esim/stats/time_sample.h"

namespace esim {

/// What is true of a stream of events. Rates are per second of the time between its first event and its last.
struct Statistics {
  SensorSize sensor;  ///< as given, or just large enough for the events
  std::uint64_t on = 0, off = 0;
  TimeNs first = 0, last = 0;  ///< of the events; meaningless if there are none
  RateCurve rate;

  Image<std::uint32_t> on_counts, off_counts, counts;  ///< events of each pixel; the last: of both polarities
  double median_count = 0;                             ///< events of a pixel
  std::uint32_t largest_count = 0;
  std::uint64_t silent_pixels = 0;  ///< without any event
  std::vector<HotPixel> hot_pixels;
  IntervalHistogram intervals;  ///< between consecutive events of the same pixel

  std::uint64_t distinct_times = 0;
  std::uint64_t simultaneous = 0;       ///< events that share their time stamp with another
  std::uint64_t most_simultaneous = 0;  ///< events with the same time stamp

  std::optional<Periodicity> periodicity;  ///< nothing if the period was given or cannot be searched for
  std::optional<PhaseTest> phase;          ///< at the given frequency, or at that of `periodicity`

  std::uint64_t events() const { return on + off; }
  double duration_s() const { return to_seconds(last - first); }
  double mean_rate_hz() const { return per_second(events()); }
  double per_second(std::uint64_t number) const {
    return last > first ? static_cast<double>(number) / duration_s() : 0.0;
  }
  /// Do the time stamps prefer phases of the period? A period that was searched for must have been found, too.
  Banding banding() const;
};

struct StatisticsOptions {
  double hot_pixel_sigmas = 5;
  std::optional<double> frame_rate_hz;  ///< to test for banding; searched for without it
};

/// Computes Statistics in one pass, in memory that does not depend on the number of events: 16 bytes per pixel and at
/// most 10 MB. How the events are divided into portions does not matter.
class EventStatistics {
 public:
  /// Without a size, the sensor grows with the events. Throws UserError if it has more than 2^26 pixels.
  explicit EventStatistics(std::optional<SensorSize> sensor = std::nullopt);

  /// Events in order of time, within 146 years, and on the sensor, as EventsFile hands them out. Throws InternalError
  /// for others, and UserError where a sensor of unknown size would become too large.
  void add(EventSpan events);

  /// Of all events so far; ends the computation.
  Statistics finish(const StatisticsOptions& options = {}) &&;

 private:
  struct Pixel {
    TimeNs last_t = 0;
    std::uint32_t on = 0, off = 0;
  };
  void make_room(const Event& event);
  void count_stamp(TimeNs t);

  bool grows_;
  Image<Pixel> pixels_;
  Statistics statistics_;
  TimeSample sample_;
  std::uint64_t same_time_ = 0;  // events at the last time
};

}  // namespace esim
