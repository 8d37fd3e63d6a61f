#include "esim/event_camera/labels/pending_labels.h"

#include <algorithm>
#include <string>
#include <utility>

#include "esim/core/error.h"

namespace esim::inline event_camera {
namespace {

[[noreturn, gnu::cold, gnu::noinline]] void fail_without_label(const Event& event) {
  throw InternalError("event camera: no label for the event at (" + std::to_string(event.x) + ", " +
                      std::to_string(event.y) + "), t = " + std::to_string(event.t) + " ns");
}

}  // namespace

PendingLabels::PendingLabels(int width, int height, std::vector<bool> hot)
    : width_(static_cast<std::uint32_t>(width)),
      hot_(std::move(hot)),
      lists_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}

/// Inserts a label after those of the pixel's earlier crossings. It is almost always the last.
inline void PendingLabels::insert(const NewLabel& label, bool was_read) {
  const auto node = static_cast<std::uint32_t>(nodes_.size());
  List& list = lists_[label.pixel];
  std::uint32_t before = list.last, after = kNone;
  if (before != kNone && nodes_[before].label.t_ideal > label.t_ideal) {
    before = kNone, after = list.first;
    while (nodes_[after].label.t_ideal <= label.t_ideal) before = std::exchange(after, nodes_[after].next);
  }
  Node& added = nodes_.emplace_back();
  added.label = label, added.next = after, added.was_read = was_read;
  (before != kNone ? nodes_[before].next : list.first) = node;
  if (after == kNone) list.last = node;
}

/// Makes the removed nodes' memory available again.
void PendingLabels::forget_removed() {
  std::erase_if(nodes_, [](const Node& node) { return node.next == kRemoved; });
  for (const Node& node : nodes_) lists_[node.label.pixel] = {};
  spare_.clear();
  spare_.swap(nodes_);
  for (const Node& node : spare_) insert(node.label, node.was_read);
  removed_ = 0;
}

void PendingLabels::add(std::vector<NewLabel>& labels) {
  if (2 * removed_ > nodes_.size()) forget_removed();
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
  fail_without_label(event);
}

inline void PendingLabels::remove(List& list, std::uint32_t before, std::uint32_t node) {
  const std::uint32_t after = nodes_[node].next;
  (before != kNone ? nodes_[before].next : list.first) = after;
  if (after == kNone) list.last = before;
  nodes_[node].next = kRemoved;
  ++removed_;
}

/// Calls body(i) for each event, while the labels of later ones arrive from memory.
template <class Body>
void PendingLabels::for_each(EventSpan events, const Body& body) {
  constexpr std::size_t kAhead = 8;
  for (std::size_t i = 0; i < events.size(); ++i) {
    if (i + 2 * kAhead < events.size()) __builtin_prefetch(&lists_[pixel_of(events[i + 2 * kAhead])]);
    if (i + kAhead < events.size()) {
      const std::uint32_t first = lists_[pixel_of(events[i + kAhead])].first;
      if (first != kNone) __builtin_prefetch(&nodes_[first]);
    }
    body(i);
  }
}

void PendingLabels::read(const Event& request, TimeNs t) {
  Node& node = nodes_[find(request, false).second];
  node.label.t = t;
  node.was_read = true;
}

void PendingLabels::read(EventSpan requests, EventSpan read) {
  for_each(requests, [&](std::size_t i) { this->read(requests[i], read[i].t); });
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
  labels.reserve(labels.size() + events.size());
  for_each(events, [&](std::size_t i) {
    const auto [before, node] = find(events[i], true);
    const std::uint32_t pixel = pixel_of(events[i]);
    explain(nodes_[node].label, !hot_.empty() && hot_[pixel], labels.emplace_back());
    remove(lists_[pixel], before, node);
  });
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
  removed_ = 0;
  std::ranges::fill(lists_, List{});
  for (const auto& [label, was_read] : labels) {
    if (label.pixel >= lists_.size()) return false;
    insert(label, was_read != 0);
  }
  return true;
}

}  // namespace esim::inline event_camera
