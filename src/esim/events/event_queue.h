#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "esim/core/parallel.h"
#include "esim/events/event_buffer.h"
#include "esim/events/event_sorter.h"

namespace esim::inline events {

/// Events that a sensor has generated but not delivered. Because tiles may be sampled at different times, events arrive
/// in any order; they are released in canonical order up to the watermark.
class EventQueue {
 public:
  /// Takes the packed events of all parts and empties the parts. Events may be in any order, but must be later than the
  /// last watermark.
  void add(std::span<PackedEvents> parts, const Workers& workers);

  /// Removes and returns the events with t <= watermark, in order. They are valid until the next add().
  EventSpan release_until(TimeNs watermark);

  std::size_t size() const;

  /// All waiting events in order, and the start of a queue with such events.
  std::vector<Event> waiting() const;
  void restore(EventSpan waiting);

  /// Calls body(event) for each event that has not been released, in any order.
  template <typename Body>
  void for_each(const Body& body) const {
    for (const Run& run : runs_) std::ranges::for_each(run.rest(), body);
  }
  /// Removes the events that have not been released and for which predicate(event) is true.
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

  std::vector<Run> runs_;            // each more than twice as long as the next, so that events are rarely moved
  EventBuffer together_, scratch_;   // events released from several runs
  std::vector<EventBuffer> unused_;  // memory to reuse
  EventSorter sorter_;
};

}  // namespace esim::inline events
