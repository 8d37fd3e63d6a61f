#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "esim/events/event.h"
#include "esim/recording/format.h"
#include "esim/stats/pixel_map.h"
#include "esim/stats/sensor/quiet_areas.h"
#include "esim/stats/sensor/row_pairs.h"
#include "esim/stats/sensor/scan.h"
#include "esim/stats/sensor/sums.h"
#include "esim/stats/stream_sample.h"

namespace esim::inline stats {

/// Statistics by which real sensors differ from each other and from simulated ones. docs/methods/statistics.md defines
/// them. Times are in whole us since the first event. A statistic that is not defined for a stream is NaN.
struct SensorStatistics : StreamSums, PixelSums {
  static constexpr std::size_t kTiles = 8;  ///< along each side of the sensor

  SensorSize sensor;
  double duration_s = 0;  ///< from the first event to the last
  TimeNs stamp_unit = 0;  ///< largest common divisor of the differences of time stamps; 0 if they are equal
  QuietAreas quiet;
  std::optional<Scan> scan;
  RowPairs::Wait row_wait;

  /// The same sums in parts of the stream and of the sensor, for resampling: blocks of equal duration, and kTiles x
  /// kTiles areas.
  std::vector<StreamSums> blocks;
  double block_s = 0;
  std::vector<PixelSums> tiles;
};

// Names of statistics that others look for.
inline constexpr std::string_view kEventRate = "events per second";
inline constexpr std::string_view kOnFraction = "ON fraction";
inline constexpr std::string_view kRowSameUs = "same row, same us, over chance";
inline constexpr std::string_view kRowLater = "same row, 1 to 5 us later, over chance";
inline constexpr std::string_view kColumnSameUs = "same column, same us, over chance";
inline constexpr std::string_view kColumnLater = "same column, 1 to 5 us later, over chance";
inline constexpr std::string_view kShortIntervals = "1 % of the intervals";
inline constexpr std::string_view kEventsPerStamp = "events per time stamp";
inline constexpr std::string_view kScanPeriod = "period of the scan";

/// How two values of a statistic are compared.
enum class Comparison : std::uint8_t { ratio, difference };

/// A statistic as a number. `unit` is empty for pure numbers.
struct NamedValue {
  std::string_view name, unit;
  Comparison comparison = Comparison::ratio;
  double value = 0;
};

/// All statistics that are single numbers, always the same ones in the same order.
std::vector<NamedValue> values_of(const SensorStatistics& statistics);

/// Computes SensorStatistics in one pass, in 24 bytes per pixel and at most 30 MB. The result does not depend on how
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

  void count_pixels(SensorStatistics& statistics) const;

  PixelMap<Pixel> pixels_;
  TimeBlocks blocks_;
  Coincidences coincidences_;
  RowPairs row_pairs_;
  std::vector<Fano> fano_;
  StreamSample<ColumnStamp> stamps_;
  bool any_ = false;
  TimeNs first_ = 0, last_ = 0, unit_ = 0;  // ns
};

}  // namespace esim::inline stats
