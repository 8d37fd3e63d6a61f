#pragma once

#include <vector>

#include "esim/events/event.h"
#include "esim/events/event_label.h"

namespace esim::inline filters {

/// Removes the labels of events that a filter has dropped. `labels` are those of `events`; the events that passed are
/// some of these, in their order (EventFilter). Of equal events, the first are taken for those that passed.
inline void keep_labels_of_passed(EventSpan events, EventSpan passed, std::vector<EventLabel>& labels) {
  std::size_t kept = 0;
  for (std::size_t i = 0; kept < passed.size(); ++i) {
    if (events[i] == passed[kept]) labels[kept++] = labels[i];
  }
  labels.resize(kept);
}

}  // namespace esim::inline filters
