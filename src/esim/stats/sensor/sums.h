#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "esim/stats/sensor/coincidences.h"
#include "esim/stats/sensor/fano.h"
#include "esim/stats/sensor/integer_histogram.h"

namespace esim::inline stats {

inline constexpr std::array<std::int64_t, 4> kFanoBins_us{100, 1'000, 10'000, 100'000};

/// Sums over the events of a span of time, from which statistics of a stream follow. The sums of several spans can be
/// added. A pair of events, an interval and a bin belong to the span in which they end.
struct StreamSums {
  std::uint64_t events = 0, on = 0;
  std::uint64_t stamps = 0;          ///< different time stamps
  Coincidences::Pairs same_us;       ///< events with the same time stamp in us
  Coincidences::Pairs after;         ///< events 1 to 5 us later
  std::uint64_t pairs = 0;           ///< consecutive events of a pixel
  std::uint64_t alike = 0;           ///< those of them with the same polarity
  IntegerHistogram intervals_us;     ///< between consecutive events of a pixel
  std::array<Fano::Sums, 4> fano{};  ///< of the counts in bins of kFanoBins_us

  void add(const StreamSums& other, std::uint64_t times = 1);

  double on_fraction() const { return fraction(on, events); }
  double alike_fraction() const { return fraction(alike, pairs); }
  double events_per_stamp() const { return fraction(events, stamps); }

 private:
  static double fraction(std::uint64_t part, std::uint64_t all) {
    return all == 0 ? std::numeric_limits<double>::quiet_NaN() : static_cast<double>(part) / static_cast<double>(all);
  }
};

/// Pearson's correlation of pairs of values.
struct Correlation {
  double n = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;  ///< sums

  void add(double x, double y) { n += 1, a += x, b += y, aa += x * x, bb += y * y, ab += x * y; }
  void add(const Correlation& other, double times = 1) {
    n += times * other.n, a += times * other.a, b += times * other.b;
    aa += times * other.aa, bb += times * other.bb, ab += times * other.ab;
  }
  /// NaN if one of the values is always the same.
  double value() const {
    const double spread = (n * aa - a * a) * (n * bb - b * b);
    return spread > 0 ? (n * ab - a * b) / std::sqrt(spread) : std::numeric_limits<double>::quiet_NaN();
  }
};

/// Sums over the pixels of an area. Those of several areas can be added.
struct PixelSums {
  IntegerHistogram counts_on, counts_off;  ///< events of a pixel
  Correlation neighbours;                  ///< of the numbers of events of pixels next to each other

  void add(const PixelSums& other, std::uint64_t times = 1);
};

/// The sums of a stream in consecutive blocks of equal duration, at most kMost of them.
class TimeBlocks {
 public:
  static constexpr std::size_t kMost = 32;

  /// The block of a time since the first event, us; never decreasing.
  StreamSums& at(std::int64_t us) {
    while (us / length_us_ >= static_cast<std::int64_t>(kMost)) join_pairs();
    const auto block = static_cast<std::size_t>(us / length_us_);
    if (block >= blocks_.size()) blocks_.resize(block + 1);
    return blocks_[block];
  }

  double length_s() const { return 1e-6 * static_cast<double>(length_us_); }
  std::vector<StreamSums> take() && { return std::move(blocks_); }

 private:
  void join_pairs();

  std::int64_t length_us_ = 1000;
  std::vector<StreamSums> blocks_;
};

}  // namespace esim::inline stats
