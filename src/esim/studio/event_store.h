#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "esim/core/time.h"
#include "esim/events/event.h"
#include "esim/record/formats/events_hdf5.h"

namespace esim::studio {

/// Events per bin.
struct EventRate {
  std::vector<std::uint64_t> on, off;
};

/// The events of one camera of a recording, any part of them at once. From any thread.
class EventStore {
 public:
  using Range = EventsHdf5Reader::IndexRange;
  virtual ~EventStore() = default;

  virtual std::uint64_t size() const = 0;

  /// Indices of the events with t0 <= t < t1.
  virtual Range find(TimeNs t0, TimeNs t1) const = 0;

  /// Up to `count` events from index `first` on.
  virtual std::vector<Event> read(std::uint64_t first, std::uint64_t count) const = 0;

  /// Of equal bins from `from` to before `to`; where they last several ms, their borders are rounded to those.
  virtual EventRate rate(TimeNs from, TimeNs to, std::size_t bins) const;

  /// At most `most` of the events of a range, evenly spread over it.
  std::vector<Event> thinned(Range range, std::uint64_t most) const;
};

/// Those of an HDF5 file, which stays on the disk.
std::unique_ptr<EventStore> store_of(EventsHdf5Reader reader);

/// Some in memory, in order.
std::unique_ptr<EventStore> store_of(std::vector<Event> events);

}  // namespace esim::studio
