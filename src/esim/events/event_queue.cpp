#include "esim/events/event_queue.h"

#include <algorithm>
#include <cstddef>

namespace esim {

void EventQueue::add(std::span<std::vector<std::uint64_t>> parts, const EventPacking& packing, const Workers& workers) {
  sorter_.sort(parts, packing, workers, added_);
  if (size() == 0) {
    pending_.swap(added_);
  } else {
    const auto rest = std::span(pending_).subspan(released_);
    merged_.resize(rest.size() + added_.size());
    std::merge(rest.begin(), rest.end(), added_.begin(), added_.end(), merged_.begin());
    pending_.swap(merged_);
  }
  released_ = 0;
}

void EventQueue::release_until(TimeNs watermark, std::vector<Event>& out) {
  const auto begin = pending_.begin() + static_cast<std::ptrdiff_t>(released_);
  const auto end =
      std::upper_bound(begin, pending_.end(), watermark, [](TimeNs t, const Event& event) { return t < event.t; });
  if (out.empty() && released_ == 0 && end == pending_.end()) {
    out.swap(pending_);
    return;
  }
  out.insert(out.end(), begin, end);
  released_ = static_cast<std::size_t>(end - pending_.begin());
}

}  // namespace esim
