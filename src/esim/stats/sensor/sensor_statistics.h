#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "esim/events/event.h"
#include "esim/recording/format.h"
#include "esim/stats/pixel_map.h"
#include "esim/stats/sensor/coincidences.h"
#include "esim/stats/sensor/fano.h"
#include "esim/stats/sensor/integer_histogram.h"
#include "esim/stats/sensor/quiet_areas.h"
#include "esim/stats/sensor/scan.h"
#include "esim/stats/stream_sample.h"

namespace esim::inline stats {

/// Statistics by which real sensors differ from each other and from simulated ones. docs/methods/statistics.md defines
/// them. Times are in whole us since the first event. A statistic that is not defined for a stream is NaN.
struct SensorStatistics {
  static constexpr std::array<std::int64_t, 4> kFanoBins_us{100, 1'000, 10'000, 100'000};

  SensorSize sensor;
  std::uint64_t events = 0, on = 0;
  double duration_s = 0;                           ///< from the first event to the last
  Coincidences::Pairs same_us;                     ///< events with the same time stamp
  Coincidences::Pairs after;                       ///< events 1 to 5 us later
  std::uint64_t pairs = 0, alike = 0;              ///< consecutive events of a pixel; those of the same polarity
  std::array<double, kFanoBins_us.size()> fano{};  ///< of the counts in bins of kFanoBins_us
  QuietAreas quiet;
  std::optional<Scan> scan;

  IntegerHistogram intervals_us;           ///< between consecutive events of a pixel
  IntegerHistogram counts_on, counts_off;  ///< events of a pixel

  double on_fraction() const { return fraction(on, events); }
  double alike_fraction() const { return fraction(alike, pairs); }

 private:
  static double fraction(std::uint64_t part, std::uint64_t all) {
    return all == 0 ? std::numeric_limits<double>::quiet_NaN() : static_cast<double>(part) / static_cast<double>(all);
  }
};

/// A statistic as a number. `unit` is empty for pure numbers.
struct NamedValue {
  std::string_view name, unit;
  double value = 0;
};

/// All statistics that are single numbers, always the same ones in the same order.
std::vector<NamedValue> values_of(const SensorStatistics& statistics);

/// A statistic of two streams. NaN if it is not defined for one of them.
struct ComparedValue {
  std::string_view name, unit;
  double first = 0, second = 0;
  double difference() const { return second - first; }
  double ratio() const { return second / first; }
};

struct SensorComparison {
  std::vector<ComparedValue> values;
  /// Kolmogorov-Smirnov distances of the events per pixel, and of the intervals.
  double ks_counts_on = 0, ks_counts_off = 0, ks_intervals = 0;
};

SensorComparison compare(const SensorStatistics& first, const SensorStatistics& second);

/// Computes SensorStatistics in one pass, in 24 bytes per pixel and at most 25 MB. The result does not depend on how
/// the events are divided into portions.
class SensorStatisticsCounter {
 public:
  /// Without a size, the sensor grows with the events. Throws UserError if it has more than 2^26 pixels.
  explicit SensorStatisticsCounter(std::optional<SensorSize> sensor = std::nullopt);

  /// Adds events in order of time and on the sensor, as EventsFile delivers them. Throws InternalError for other
  /// events, and UserError if a sensor of unknown size becomes too large.
  void add(EventSpan events);

  /// The statistics of all events; ends the computation.
  SensorStatistics finish() &&;

 private:
  struct Pixel {
    TimeNs last = 0;  // us since the first event
    std::uint32_t on = 0, off = 0;
    std::uint32_t supported = 0;
    std::int8_t polarity = 0;  // of the last event; 0: none
  };
  bool is_supported(const Event& event, TimeNs us) const;

  PixelMap<Pixel> pixels_;
  SensorStatistics statistics_;
  Coincidences coincidences_;
  std::vector<Fano> fano_;
  StreamSample<ColumnStamp> stamps_;
  TimeNs first_ = 0, last_ = 0;  // ns
};

}  // namespace esim::inline stats
