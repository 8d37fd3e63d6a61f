#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "esim/core/time.h"
#include "esim/events/event.h"
#include "esim/record/formats/events_hdf5.h"

namespace esim::studio {

/// Events in bins of time.
struct EventRate {
  std::vector<TimeNs> edges;           ///< ns, of the bins one after the other: one more than there are bins
  std::vector<std::uint64_t> on, off;  ///< events with edges[i] <= t < edges[i + 1]
};

/// Edges of at most `most` bins (at least 1) of the times from <= t < to. The edges between are multiples of one width,
/// counted from `origin`, and the width is one of `unit`: time stamps that are multiples of the unit fall into all bins
/// alike. The first bin and the last are between half and one and a half times as wide. All in ns.
std::vector<TimeNs> bin_edges(TimeNs from, TimeNs to, std::size_t most, TimeNs unit, TimeNs origin);

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

  /// In at most `most` bins of the times from <= t < to: their widths are whole ms, of which the files have an index,
  /// or whole us where they are shorter than a few ms.
  EventRate rate(TimeNs from, TimeNs to, std::size_t most) const;

  /// At most `most` of the events of a range, evenly spread over it.
  std::vector<Event> thinned(Range range, std::uint64_t most) const;

 protected:
  /// Where the first ms begins.
  virtual TimeNs origin() const { return 0; }

  /// Counts the events between the edges.
  virtual void count(EventRate& rate) const;
};

/// Those of an HDF5 file, which stays on the disk.
std::unique_ptr<EventStore> store_of(EventsHdf5Reader reader);

/// Some in memory, in order.
std::unique_ptr<EventStore> store_of(std::vector<Event> events);

}  // namespace esim::studio
