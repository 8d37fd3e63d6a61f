#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "esim/core/parallel.h"
#include "esim/events/event_buffer.h"
#include "esim/events/event_sorter.h"

namespace esim {

/// Events that a sensor has made but not yet delivered. Tiles may be sampled at different times, so events
/// arrive in any order; they leave in the one order of events, as far as the watermark allows.
class EventQueue {
 public:
  /// Takes the packed events of all parts, in any order but later than the last watermark, and empties the parts.
  void add(std::span<PackedEvents> parts, const Workers& workers);

  /// Forgets every event with t <= watermark, and returns them in order: they are there until the next add().
  EventSpan release_until(TimeNs watermark);

  std::size_t size() const { return pending_.size() - released_; }

 private:
  EventBuffer pending_;       // ordered
  std::size_t released_ = 0;  // of pending_, from its front
  EventBuffer added_, merged_;
  EventSorter sorter_;
};

}  // namespace esim
