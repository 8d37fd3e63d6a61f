#include "esim/events/event.h"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

namespace esim {
namespace {

constexpr int kDigitBits = 11;
constexpr std::size_t kBuckets = std::size_t{1} << kDigitBits;
constexpr std::size_t kTooFewForRadix = 256;

/// One stable pass of a least-significant-digit radix sort on (t - origin).
void radix_pass(std::span<const Event> from, std::span<Event> to, TimeNs origin, int shift) {
  std::array<std::size_t, kBuckets> position{};
  const auto digit = [&](const Event& event) {
    return (static_cast<std::uint64_t>(event.t - origin) >> shift) & (kBuckets - 1);
  };
  for (const Event& event : from) ++position[digit(event)];
  std::size_t sum = 0;
  for (std::size_t& count : position) sum += std::exchange(count, sum);
  for (const Event& event : from) to[position[digit(event)]++] = event;
}

/// Puts runs of equal time, already together, into the order of (y, x, polarity).
void order_simultaneous(std::vector<Event>& events) {
  for (std::size_t i = 1; i < events.size(); ++i) {
    if (!(events[i] < events[i - 1])) continue;
    const TimeNs t = events[i].t;
    std::size_t first = i - 1, last = i + 1;
    while (first > 0 && events[first - 1].t == t) --first;
    while (last < events.size() && events[last].t == t) ++last;
    std::sort(events.begin() + static_cast<std::ptrdiff_t>(first), events.begin() + static_cast<std::ptrdiff_t>(last));
    i = last;
  }
}

}  // namespace

void sort_events(std::vector<Event>& events) {
  std::vector<Event> scratch;
  sort_events(events, scratch);
}

void sort_events(std::vector<Event>& events, std::vector<Event>& scratch) {
  if (events.size() < kTooFewForRadix) {
    std::sort(events.begin(), events.end());
    return;
  }
  const auto earlier = [](const Event& a, const Event& b) { return a.t < b.t; };
  const auto [first, last] = std::minmax_element(events.begin(), events.end(), earlier);
  const TimeNs origin = first->t;
  const int bits = static_cast<int>(std::bit_width(static_cast<std::uint64_t>(last->t - origin)));

  scratch.resize(events.size());
  for (int shift = 0; shift < bits; shift += kDigitBits) {
    radix_pass(events, scratch, origin, shift);
    events.swap(scratch);
  }
  order_simultaneous(events);
}

}  // namespace esim
