#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "esim/core/parallel.h"
#include "esim/events/event_buffer.h"
#include "esim/events/event_packing.h"
#include "esim/events/packed_events.h"

namespace esim::inline events {

/// Events that a sensor has generated but not delivered. Because tiles may be sampled at different times, events arrive
/// in any order; they are released in canonical order up to the watermark. A calendar queue: events wait unsorted in
/// bins of time, and are sorted when the watermark reaches their bin.
class EventQueue {
 public:
  EventQueue(int width, int height) : packing_(width, height) {}

  /// Takes the packed events of all parts, which must have the same packing, and empties the parts. Events may be in
  /// any order, but must be later than the last watermark. Most of them should be earlier than `end`.
  void add(std::span<PackedEvents> parts, TimeNs end);

  /// Sorts the events with t <= watermark in parallel. Only for speed: release_until() sorts those that are left.
  void sort_until(TimeNs watermark, const Workers& workers);

  /// Removes and returns the events with t <= watermark, in order. They are valid until the next add().
  EventSpan release_until(TimeNs watermark);

  std::size_t size() const { return sorted_.size() - released_ + waiting_; }

  /// All waiting events in order, and the start of a queue with such events.
  std::vector<Event> waiting() const;
  void restore(EventSpan waiting);

  /// Calls body(event) for each event that has not been released, in any order.
  template <typename Body>
  void for_each(const Body& body) const;

  /// Removes the events that have not been released and for which predicate(event) is true.
  template <typename Predicate>
  void remove_if(const Predicate& predicate);

 private:
  static constexpr std::size_t kBins = 64;

  EventPacking packing_of(std::size_t bin) const;
  void put(const EventPacking& packing, std::span<const std::uint64_t> events);
  void fit_bins(TimeNs begin, TimeNs end);
  void drop_bins(std::size_t count);

  EventPacking packing_;  // with another origin for each bin
  TimeNs begin_ = 0;      // of the first bin
  int width_bits_ = 0;    // a bin is 2 to this power ns long
  TimeNs latest_ = 0;     // no waiting event is later
  // The origin of their events is the begin of the bin. The last bin has no end.
  std::array<std::vector<std::uint64_t>, kBins> bins_;
  std::size_t waiting_ = 0;  // events in all bins

  EventBuffer sorted_;  // of which the first released_ have been released
  std::size_t released_ = 0;
  std::vector<std::uint64_t> scratch_;
  Workers one_thread_{1};
};

template <typename Body>
void EventQueue::for_each(const Body& body) const {
  for (const Event& event : sorted_.events().subspan(released_)) body(event);
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    const EventPacking packing = packing_of(bin);
    for (const std::uint64_t packed : bins_[bin]) {
      Event event;
      packing.unpack(packed, event);
      body(event);
    }
  }
}

template <typename Predicate>
void EventQueue::remove_if(const Predicate& predicate) {
  sorted_.remove_if(released_, predicate);
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    const EventPacking packing = packing_of(bin);
    waiting_ -= std::erase_if(bins_[bin], [&](std::uint64_t packed) {
      Event event;
      packing.unpack(packed, event);
      return predicate(event);
    });
  }
}

}  // namespace esim::inline events
