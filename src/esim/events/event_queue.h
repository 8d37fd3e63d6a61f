#pragma once

#include <algorithm>
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

  std::size_t size() const;

  /// All events that wait, in order, and a queue's beginning with such events.
  std::vector<Event> waiting() const;
  void restore(EventSpan waiting);

  /// Calls body(event) for each event that has not been released, in any order.
  template <typename Body>
  void for_each(const Body& body) const {
    for (const Run& run : runs_) std::ranges::for_each(run.rest(), body);
  }
  /// Forgets the events that have not been released and for which predicate(event).
  template <typename Predicate>
  void remove_if(const Predicate& predicate) {
    for (Run& run : runs_) run.events.remove_if(run.released, predicate);
  }

 private:
  /// Ordered events, of which the first ones have been released.
  struct Run {
    EventBuffer events;
    std::size_t released = 0;

    EventSpan rest() const { return events.events().subspan(released); }
  };

  EventBuffer take_buffer();
  void merge_last_two();

  std::vector<Run> runs_;            // each more than twice as long as the next, so that an event is seldom moved
  EventBuffer together_, scratch_;   // what is released from several runs
  std::vector<EventBuffer> unused_;  // memory
  EventSorter sorter_;
};

}  // namespace esim
