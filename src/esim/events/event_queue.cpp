#include "esim/events/event_queue.h"

#include <algorithm>
#include <cstddef>

namespace esim {

void EventQueue::add(std::span<PackedEvents> parts, const Workers& workers) {
  sorter_.sort(parts, workers, added_);
  if (size() == 0) {
    pending_.swap(added_);
  } else {
    const EventSpan rest = pending_.events().subspan(released_), added = added_.events();
    std::merge(rest.begin(), rest.end(), added.begin(), added.end(), merged_.make_room(rest.size() + added.size()));
    pending_.swap(merged_);
  }
  released_ = 0;
}

EventSpan EventQueue::release_until(TimeNs watermark) {
  const EventSpan rest = pending_.events().subspan(released_);
  const auto end =
      std::upper_bound(rest.begin(), rest.end(), watermark, [](TimeNs t, const Event& event) { return t < event.t; });
  const EventSpan released = rest.first(static_cast<std::size_t>(end - rest.begin()));
  released_ += released.size();
  return released;
}

}  // namespace esim
