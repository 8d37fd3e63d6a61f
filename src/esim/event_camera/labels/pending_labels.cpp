#include "esim/event_camera/labels/pending_labels.h"

#include <algorithm>
#include <string>
#include <utility>

#include "esim/core/error.h"

namespace esim::inline event_camera {

PendingLabels::PendingLabels(int width, int height, std::vector<bool> hot)
    : width_(static_cast<std::uint32_t>(width)),
      hot_(std::move(hot)),
      lists_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}

/// Inserts a label after those of the pixel's earlier crossings. It is almost always the last.
inline void PendingLabels::insert(const NewLabel& label, bool was_read) {
  const std::uint32_t node = free_ != kNone ? free_ : static_cast<std::uint32_t>(nodes_.size());
  if (free_ != kNone) {
    free_ = nodes_[node].next;
  } else {
    nodes_.emplace_back();
  }
  List& list = lists_[label.pixel];
  std::uint32_t before = list.last, after = kNone;
  if (before != kNone && nodes_[before].label.t_ideal > label.t_ideal) {
    before = kNone, after = list.first;
    while (nodes_[after].label.t_ideal <= label.t_ideal) before = std::exchange(after, nodes_[after].next);
  }
  nodes_[node] = {label, after, was_read};
  (before != kNone ? nodes_[before].next : list.first) = node;
  if (after == kNone) list.last = node;
}

void PendingLabels::add(std::vector<NewLabel>& labels) {
  for (const NewLabel& label : labels) insert(label, false);
  labels.clear();
}

inline std::pair<std::uint32_t, std::uint32_t> PendingLabels::find(const Event& event, bool was_read) const {
  std::uint32_t before = kNone;
  for (std::uint32_t node = lists_[pixel_of(event)].first; node != kNone; node = nodes_[node].next) {
    const NewLabel& label = nodes_[node].label;
    if (label.t == event.t && label.polarity == event.polarity && (was_read || !nodes_[node].was_read))
      return {before, node};
    before = node;
  }
  throw InternalError("event camera: no label for the event at (" + std::to_string(event.x) + ", " +
                      std::to_string(event.y) + "), t = " + std::to_string(event.t) + " ns");
}

inline void PendingLabels::remove(List& list, std::uint32_t before, std::uint32_t node) {
  const std::uint32_t after = nodes_[node].next;
  (before != kNone ? nodes_[before].next : list.first) = after;
  if (after == kNone) list.last = before;
  nodes_[node].next = std::exchange(free_, node);
}

void PendingLabels::read(const Event& request, TimeNs t) {
  Node& node = nodes_[find(request, false).second];
  node.label.t = t;
  node.was_read = true;
}

void PendingLabels::drop(const Event& request) {
  const auto [before, node] = find(request, false);
  remove(lists_[pixel_of(request)], before, node);
}

void PendingLabels::drop_unread(std::uint32_t pixel) {
  List& list = lists_[pixel];
  for (std::uint32_t before = kNone, node = list.first; node != kNone;) {
    const std::uint32_t next = nodes_[node].next;
    if (nodes_[node].was_read) {
      before = node;
    } else {
      remove(list, before, node);
    }
    node = next;
  }
}

void PendingLabels::take(EventSpan events, std::vector<EventLabel>& labels) {
  for (const Event& event : events) {
    const auto [before, node] = find(event, true);
    const std::uint32_t pixel = pixel_of(event);
    labels.push_back(to_label(nodes_[node].label, !hot_.empty() && hot_[pixel]));
    remove(lists_[pixel], before, node);
  }
}

TimeNs PendingLabels::earliest() const {
  TimeNs earliest = std::numeric_limits<TimeNs>::max();
  for (const List& list : lists_) {
    if (list.first != kNone) earliest = std::min(earliest, nodes_[list.first].label.t_ideal);
  }
  return earliest;
}

std::vector<PendingLabels::Waiting> PendingLabels::waiting() const {
  std::vector<Waiting> labels;
  for (const List& list : lists_) {
    for (std::uint32_t node = list.first; node != kNone; node = nodes_[node].next)
      labels.push_back({nodes_[node].label, nodes_[node].was_read ? 1U : 0U});
  }
  return labels;
}

bool PendingLabels::restore(std::span<const Waiting> labels) {
  nodes_.clear();
  free_ = kNone;
  std::ranges::fill(lists_, List{});
  for (const auto& [label, was_read] : labels) {
    if (label.pixel >= lists_.size()) return false;
    insert(label, was_read != 0);
  }
  return true;
}

}  // namespace esim::inline event_camera
