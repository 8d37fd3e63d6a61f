#include "esim/events/event_queue.h"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace esim::inline events {
namespace {

/// std::merge() of events whose order cannot be predicted: without a branch that depends on it.
void merge(EventSpan a, EventSpan b, EventBuffer& out) {
  Event* next = out.make_room(a.size() + b.size());
  const Event *first = a.data(), *second = b.data();
  const Event *const first_end = first + a.size(), *const second_end = second + b.size();
  while (first != first_end && second != second_end) {
    bool is_second = second->t < first->t;
    if (second->t == first->t) [[unlikely]]
      is_second = *second < *first;
    *next++ = *(is_second ? second : first);
    first += is_second ? 0 : 1;
    second += is_second ? 1 : 0;
  }
  std::copy(second, second_end, std::copy(first, first_end, next));
}

}  // namespace

EventBuffer EventQueue::take_buffer() {
  if (unused_.empty()) return {};
  const auto largest = std::ranges::max_element(unused_, {}, &EventBuffer::capacity);
  std::swap(*largest, unused_.back());
  EventBuffer buffer = std::move(unused_.back());
  unused_.pop_back();
  return buffer;
}

void EventQueue::merge_last_two() {
  Run &before = runs_[runs_.size() - 2], &last = runs_.back();
  Run merged{take_buffer(), 0};
  merge(before.rest(), last.rest(), merged.events);
  unused_.push_back(std::move(before.events));
  unused_.push_back(std::move(last.events));
  runs_.pop_back();
  runs_.back() = std::move(merged);
}

void EventQueue::add(std::span<PackedEvents> parts, const Workers& workers) {
  std::size_t kept = 0;
  for (Run& run : runs_) {
    if (run.rest().empty()) {
      unused_.push_back(std::move(run.events));
    } else {
      std::swap(runs_[kept++], run);
    }
  }
  runs_.resize(kept);
  runs_.push_back({take_buffer(), 0});
  sorter_.sort(parts, workers, runs_.back().events);
  while (runs_.size() > 1 && runs_[runs_.size() - 2].rest().size() <= 2 * runs_.back().rest().size()) merge_last_two();
}

EventSpan EventQueue::release_until(TimeNs watermark) {
  EventSpan released;
  for (Run& run : runs_) {
    const EventSpan rest = run.rest();
    const auto end =
        std::upper_bound(rest.begin(), rest.end(), watermark, [](TimeNs t, const Event& event) { return t < event.t; });
    const EventSpan part = rest.first(static_cast<std::size_t>(end - rest.begin()));
    run.released += part.size();
    if (released.empty()) {
      released = part;
    } else if (!part.empty()) {
      merge(released, part, scratch_);
      together_.swap(scratch_);
      released = together_.events();
    }
  }
  return released;
}

std::vector<Event> EventQueue::waiting() const {
  std::vector<Event> events;
  for_each([&](const Event& event) { events.push_back(event); });
  std::sort(events.begin(), events.end());
  return events;
}

void EventQueue::restore(EventSpan waiting) {
  runs_.clear();
  if (waiting.empty()) return;
  std::copy(waiting.begin(), waiting.end(), runs_.emplace_back().events.make_room(waiting.size()));
}

std::size_t EventQueue::size() const {
  std::size_t count = 0;
  for (const Run& run : runs_) count += run.rest().size();
  return count;
}

}  // namespace esim::inline events
