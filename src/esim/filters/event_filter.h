#pragma once

#include <vector>

#include "esim/events/event.h"

namespace esim::inline filters {

/// One digital block behind the pixels of an event camera: passes some of the events on and drops the others. It is
/// causal, as on a chip: whether an event passes depends on this event and on earlier ones only.
class EventFilter {
 public:
  virtual ~EventFilter() = default;

  /// Appends the events that pass to `out`, unchanged and in their order. The events of all calls together are one
  /// stream in canonical order; where it is cut into calls makes no difference.
  virtual void process(EventSpan events, std::vector<Event>& out) = 0;
};

}  // namespace esim::inline filters
