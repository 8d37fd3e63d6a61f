#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "esim/stats/sensor/sensor_statistics.h"

namespace esim::inline compare {

/// A statistic of two recordings, and how far apart it is.
struct ComparedStatistic {
  enum class Kind : std::uint8_t { ratio, difference, distribution };

  std::string name, unit;
  Kind kind = Kind::ratio;
  double first = 0, second = 0;  ///< the values; NaN for distributions
  /// second / first, second - first, or the Kolmogorov-Smirnov distance; NaN if it is not defined.
  double distance = 0;
  double low = 0, high = 0;  ///< 95 % interval of the distance, by resampling both recordings; NaN if not known
  /// The distance from that of equal sensors, in standard deviations; NaN if not known. Infinite if the statistic has
  /// no scatter, such as the unit of time stamps.
  double deviations = 0;

  /// Beyond this, the statistic tells the recordings apart: 1 % by chance for all statistics together.
  static constexpr double kClear = 3.5;
  bool distinguishes() const { return deviations > kClear; }
};

/// Compares recordings of two sensors. Blocks of time and areas of the sensors are drawn with replacement, 200 times,
/// which gives the scatter of each statistic, also if neighbouring events depend on each other. A distribution (events
/// per pixel, intervals) is compared with that of blocks drawn from both recordings together. Recordings with fewer
/// than 8 blocks or areas with events have values without intervals. The result depends only on the recordings.
std::vector<ComparedStatistic> compare_sensors(const SensorStatistics& first, const SensorStatistics& second);

/// Those that distinguish, the clearest first.
std::vector<const ComparedStatistic*> distinguishing(const std::vector<ComparedStatistic>& statistics);

}  // namespace esim::inline compare
