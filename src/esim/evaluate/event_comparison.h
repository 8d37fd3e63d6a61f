#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "esim/events/event.h"

namespace esim {

/// Time and polarity of one pixel's event.
struct PixelEvent {
  TimeNs t = 0;
  std::int8_t polarity = 0;
};

/// Events by pixel: row by row, each pixel's in their order.
class EventsByPixel {
 public:
  EventsByPixel(EventSpan events, int width, int height);

  std::size_t pixels() const { return first_.size() - 1; }
  std::size_t events() const { return events_.size(); }
  std::span<const PixelEvent> of(std::size_t pixel) const {
    return {events_.data() + first_[pixel], first_[pixel + 1] - first_[pixel]};
  }

 private:
  std::vector<std::size_t> first_;
  std::vector<PixelEvent> events_;
};

/// Which events of a pixel answer to which of a reference.
struct EventMatch {
  std::vector<double> differences_s;  ///< t - t_reference of the pairs
  std::int64_t missing = 0;           ///< of the reference, without a counterpart
  std::int64_t spurious = 0;          ///< without a counterpart in the reference
  bool identical = false;             ///< the same number with the same polarities in the same order
};

/// An event that is left alone costs as much as two of a pair that are this far apart in time.
inline constexpr TimeNs kUnmatchedCost = 10 * kNsPerMs;

/// Pairs the events of a pixel. Identical sequences of polarities: in order. Others: pairs have one polarity and do not
/// cross, and of all such pairings the one is taken of which the sum of |t - t_reference| and of kUnmatchedCost for
/// each event without a counterpart is least.
EventMatch match_events(std::span<const PixelEvent> reference, std::span<const PixelEvent> events);

/// All pixels' matches together.
struct EventComparison {
  std::int64_t reference = 0, events = 0;
  std::int64_t matched = 0, missing = 0, spurious = 0;
  std::int64_t active_pixels = 0;     ///< with an event in either
  std::int64_t identical_pixels = 0;  ///< of these, with identical sequences
  double median_s = 0, p95_s = 0;     ///< of |t - t_reference| over the pairs
  std::vector<double> quantiles_s;    ///< of the same at 0, 1, ... 100 %; empty without pairs

  double count_ratio() const {
    return reference > 0 ? static_cast<double>(events) / static_cast<double>(reference) : 0;
  }
  double identical_share() const {
    return active_pixels > 0 ? static_cast<double>(identical_pixels) / static_cast<double>(active_pixels) : 1;
  }
};

/// Both of the same sensor and time, from equal initial states.
EventComparison compare_events(const EventsByPixel& reference, const EventsByPixel& events);

}  // namespace esim
