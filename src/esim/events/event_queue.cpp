#include "esim/events/event_queue.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "esim/events/sort_packed.h"

namespace esim::inline events {
namespace {

// The bins that waiting events span, as powers of 2: of new bins, and at least and at most.
constexpr int kNewBits = 5, kLeastBits = 4, kMostBits = 6;
constexpr std::size_t kTooFewToShare = 1024;

/// a - b, where b is not later.
std::uint64_t since(TimeNs a, TimeNs b) { return static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b); }

}  // namespace

/// The packing of the events in a bin.
EventPacking EventQueue::packing_of(std::size_t bin) const {
  EventPacking packing = packing_;
  packing.origin = begin_ + (static_cast<TimeNs>(bin) << width_bits_);
  return packing;
}

/// Puts packed events into their bins.
void EventQueue::put(const EventPacking& packing, std::span<const std::uint64_t> events) {
  if (events.empty()) return;
  const int shift = packing.time_shift();
  const std::uint64_t later = since(packing.origin, begin_);
  std::uint64_t last = 0;
  for (const std::uint64_t event : events) {
    const std::uint64_t bin = std::min<std::uint64_t>((later + (event >> shift)) >> width_bits_, kBins - 1);
    bins_[bin].push_back(event + ((later - (bin << width_bits_)) << shift));
    last = std::max(last, event);
  }
  latest_ = std::max(latest_, packing.origin + packing.time(last));
  waiting_ += events.size();
}

/// Makes the bins suit the waiting events and others from `begin` to `end`.
void EventQueue::fit_bins(TimeNs begin, TimeNs end) {
  if (waiting_ == 0) latest_ = begin;
  const TimeNs first = waiting_ > 0 ? std::min(begin, begin_) : begin, last = std::max(end, latest_);
  const int span_bits = static_cast<int>(std::bit_width(since(last, first))), bins_bits = span_bits - width_bits_;
  const bool fit = first == begin_ && bins_bits <= kMostBits && (bins_bits >= kLeastBits || width_bits_ == 0);
  if (waiting_ > 0 && fit) return;
  EventPacking packing = packing_of(0);
  const TimeNs width = TimeNs{1} << width_bits_;
  begin_ = first;
  width_bits_ = std::max(0, span_bits - kNewBits);
  if (std::exchange(waiting_, 0) == 0) return;
  const auto moved = std::exchange(bins_, {});
  for (const std::vector<std::uint64_t>& bin : moved) {
    put(packing, bin);
    packing.origin += width;
  }
}

void EventQueue::add(std::span<PackedEvents> parts, TimeNs end) {
  for (PackedEvents& part : parts) {
    if (part.size() == 0) continue;
    fit_bins(part.packing().origin, end);
    put(part.packing(), part.events());
    part.clear();
  }
}

void EventQueue::sort_until(TimeNs watermark, const Workers& workers) {
  if (waiting_ == 0 || watermark < begin_) return;
  // All events of the bins before this one are due.
  const auto last =
      static_cast<std::size_t>(std::min<std::uint64_t>(since(watermark, begin_) >> width_bits_, kBins - 1));
  std::vector<std::uint64_t>& partly = bins_[last];
  const std::uint64_t longest = since(watermark, packing_of(last).origin);
  const auto due = std::partition(partly.begin(), partly.end(),
                                  [&](std::uint64_t event) { return event >> packing_.time_shift() <= longest; });

  std::array<std::size_t, kBins + 1> begins{};
  const auto due_of = [&](std::size_t bin) {
    return bin < last ? std::span(bins_[bin]) : std::span(partly.begin(), due);
  };
  for (std::size_t bin = 0; bin <= last; ++bin) begins[bin + 1] = begins[bin] + due_of(bin).size();
  const std::size_t count = begins[last + 1];
  sorted_.drop(std::exchange(released_, 0));
  Event* const sorted = sorted_.extend(count);
  if (scratch_.size() < count) scratch_.resize(2 * count);
  const auto sort_bin = [&](int i) {
    const auto bin = static_cast<std::size_t>(i);
    const std::span<std::uint64_t> events = due_of(bin);
    const EventPacking packing = packing_of(bin);
    sort_packed(events, std::span(scratch_).subspan(begins[bin], events.size()), packing);
    Event* out = sorted + begins[bin];
    for (const std::uint64_t event : events) packing.unpack(event, *out++);
  };
  if (count < kTooFewToShare) {
    for (std::size_t bin = 0; bin <= last; ++bin) sort_bin(static_cast<int>(bin));
  } else {
    workers.for_each(static_cast<int>(last) + 1, sort_bin);
  }
  partly.erase(partly.begin(), due);
  waiting_ -= count;
  drop_bins(last);
}

/// Removes the first bins, whose events have been taken.
void EventQueue::drop_bins(std::size_t count) {
  if (count == 0) return;
  for (std::size_t bin = 0; bin < count; ++bin) bins_[bin].clear();
  const EventPacking endless = packing_of(kBins - 1);
  begin_ = packing_of(count).origin;
  std::rotate(bins_.begin(), bins_.begin() + static_cast<std::ptrdiff_t>(count), bins_.end());
  // Events of the bin without an end may now belong to later bins.
  const std::vector<std::uint64_t> moved = std::exchange(bins_[kBins - 1 - count], {});
  waiting_ -= moved.size();
  put(endless, moved);
}

EventSpan EventQueue::release_until(TimeNs watermark) {
  sort_until(watermark, one_thread_);
  const EventSpan rest = sorted_.events().subspan(released_);
  const auto end = std::ranges::upper_bound(rest, watermark, {}, &Event::t);
  const EventSpan released(rest.begin(), end);
  released_ += released.size();
  return released;
}

std::vector<Event> EventQueue::waiting() const {
  std::vector<Event> events;
  for_each([&](const Event& event) { events.push_back(event); });
  std::sort(events.begin(), events.end());
  return events;
}

void EventQueue::restore(EventSpan waiting) {
  for (std::vector<std::uint64_t>& bin : bins_) bin.clear();
  waiting_ = 0;
  sorted_.drop(sorted_.size());
  released_ = 0;
  if (waiting.empty()) return;
  EventPacking packing = packing_;
  packing.origin = waiting.front().t;
  std::vector<std::uint64_t> packed;
  for (const Event& event : waiting)
    packed.push_back(packing.pack(event.t - packing.origin, packing.place(event.x, event.y), event.polarity > 0));
  fit_bins(packing.origin, waiting.back().t);
  put(packing, packed);
}

}  // namespace esim::inline events
