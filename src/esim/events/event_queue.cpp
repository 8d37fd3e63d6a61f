#include "esim/events/event_queue.h"

#include <algorithm>

namespace esim {

void EventQueue::release_until(TimeNs watermark, std::vector<Event>& out) {
  // Merge what came in with what was left from before.
  sort_events(incoming_, scratch_);
  if (pending_.empty()) {
    pending_.swap(incoming_);
  } else if (!incoming_.empty()) {
    const auto middle = static_cast<std::ptrdiff_t>(pending_.size());
    pending_.insert(pending_.end(), incoming_.begin(), incoming_.end());
    std::inplace_merge(pending_.begin(), pending_.begin() + middle, pending_.end());
  }
  incoming_.clear();

  // Release the front.
  const auto end = std::upper_bound(pending_.begin(), pending_.end(), watermark,
                                    [](TimeNs t, const Event& event) { return t < event.t; });
  out.insert(out.end(), pending_.begin(), end);
  pending_.erase(pending_.begin(), end);
}

}  // namespace esim
