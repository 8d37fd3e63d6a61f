#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "esim/events/event.h"

namespace esim::inline compare {

/// An event of one pixel.
struct PixelEvent {
  TimeNs t = 0;
  std::int8_t polarity = 0;
};

/// Events grouped by pixel, row by row; the events of a pixel keep their order.
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

/// The events of a pixel matched with those of a reference.
struct EventMatch {
  std::vector<double> differences_s;  ///< t - t_reference of the pairs
  std::int64_t missing = 0;           ///< reference events without a counterpart
  std::int64_t spurious = 0;          ///< events without a counterpart in the reference
  bool identical = false;             ///< same number of events with the same polarities in the same order
};

/// Cost of an event without a counterpart: that of a pair with this difference in time.
inline constexpr TimeNs kUnmatchedCost = 10 * kNsPerMs;

/// Pairs the events of a pixel with those of the reference. If the sequences of polarities are identical, the events
/// are paired in order. Otherwise both events of a pair have the same polarity, pairs do not cross, and the pairing
/// minimises the sum of |t - t_reference| and of kUnmatchedCost for each event without a counterpart.
EventMatch match_events(std::span<const PixelEvent> reference, std::span<const PixelEvent> events);

/// The matches of all pixels.
struct EventComparison {
  std::int64_t reference = 0, events = 0;
  std::int64_t matched = 0, missing = 0, spurious = 0;
  std::int64_t active_pixels = 0;     ///< pixels with an event in either stream
  std::int64_t identical_pixels = 0;  ///< active pixels with identical sequences
  double median_s = 0, p95_s = 0;     ///< of |t - t_reference| over the pairs
  std::vector<double> quantiles_s;    ///< quantiles of it at 0, 1, ... 100 %; empty without pairs

  double count_ratio() const {
    return reference > 0 ? static_cast<double>(events) / static_cast<double>(reference) : 0;
  }
  double identical_fraction() const {
    return active_pixels > 0 ? static_cast<double>(identical_pixels) / static_cast<double>(active_pixels) : 1;
  }
};

/// Both streams must come from the same sensor and time span, and from equal initial states.
EventComparison compare_events(const EventsByPixel& reference, const EventsByPixel& events);

}  // namespace esim::inline compare
