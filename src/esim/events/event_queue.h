#pragma once

#include <vector>

#include "esim/events/event.h"

namespace esim {

/// Events that a sensor has made but not yet delivered. Tiles may be sampled at different times, so events
/// arrive in any order; they leave in the one order of events, as far as the watermark allows.
class EventQueue {
 public:
  /// Room to append events to; anything later than the last watermark may be added, in any order.
  std::vector<Event>& incoming() { return incoming_; }

  /// Appends to `out`, in order, every event with t <= watermark, and forgets them.
  void release_until(TimeNs watermark, std::vector<Event>& out);

  std::size_t size() const { return incoming_.size() + pending_.size(); }

 private:
  std::vector<Event> incoming_;  // unordered
  std::vector<Event> pending_;   // ordered, later than the last watermark
  std::vector<Event> scratch_;   // for sorting
};

}  // namespace esim
