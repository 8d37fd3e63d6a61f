#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "esim/core/time.h"
#include "esim/events/event.h"
#include "esim/formats/hdf5/dsec.h"

namespace esim::studio {

/// Events in bins of time.
struct EventRate {
  std::vector<TimeNs> edges;           ///< ns; one more than there are bins
  std::vector<std::uint64_t> on, off;  ///< events with edges[i] <= t < edges[i + 1]
};

/// Edges of at most `max` bins (at least 1) that cover from <= t < to, in ns. Inner edges are multiples of one width,
/// counted from `origin`, and the width is a multiple of `unit`, so that time stamps in this unit fall evenly into all
/// bins. The first and the last bin are between half and one and a half times as wide.
std::vector<TimeNs> bin_edges(TimeNs from, TimeNs to, std::size_t max, TimeNs unit, TimeNs origin);

/// The events of one camera of a recording, with random access. Thread-safe.
class EventStore {
 public:
  using Range = EventsHdf5Reader::IndexRange;
  virtual ~EventStore() = default;

  virtual std::uint64_t size() const = 0;

  /// Indices of the events with t0 <= t < t1.
  virtual Range find(TimeNs t0, TimeNs t1) const = 0;

  /// Up to `count` events, starting at index `first`.
  virtual std::vector<Event> read(std::uint64_t first, std::uint64_t count) const = 0;

  /// Counts in at most `max` bins that cover from <= t < to. Widths are multiples of 1 ms, for which files have an
  /// index, or of 1 us for bins shorter than a few ms.
  EventRate rate(TimeNs from, TimeNs to, std::size_t max) const;

  /// At most `max` events of a range, evenly spread over it.
  std::vector<Event> thinned(Range range, std::uint64_t max) const;

 protected:
  /// The start of the first ms.
  virtual TimeNs origin() const { return 0; }

  /// Counts the events between the edges.
  virtual void count(EventRate& rate) const;
};

/// The events of an HDF5 file, read on demand.
std::unique_ptr<EventStore> store_of(EventsHdf5Reader reader);

/// Events in memory, in order of time.
std::unique_ptr<EventStore> store_of(std::vector<Event> events);

}  // namespace esim::studio
