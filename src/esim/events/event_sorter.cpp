#include "esim/events/event_sorter.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <utility>

namespace esim::inline events {
namespace {

constexpr int kMaxDigitBits = 11;
constexpr std::size_t kTooFewForRadix = 64;

using Counts = std::array<std::uint32_t, std::size_t{1} << kMaxDigitBits>;

/// Converts the counts of the buckets to their positions.
void add_up(Counts& counts, std::size_t buckets) {
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < buckets; ++i) sum += std::exchange(counts[i], sum);
}

/// Two stable passes of a radix sort, by `bits` bits from `shift` on and by the next `bits` above; the result is in
/// `keys`.
void two_passes(std::span<std::uint64_t> keys, std::span<std::uint64_t> scratch, int shift, int bits) {
  const std::size_t buckets = std::size_t{1} << bits, mask = buckets - 1;
  Counts low, high;
  std::fill_n(low.begin(), buckets, 0U);
  std::fill_n(high.begin(), buckets, 0U);
  for (const std::uint64_t key : keys) ++low[(key >> shift) & mask], ++high[(key >> (shift + bits)) & mask];
  add_up(low, buckets);
  add_up(high, buckets);
  for (const std::uint64_t key : keys) scratch[low[(key >> shift) & mask]++] = key;
  for (const std::uint64_t key : scratch.first(keys.size())) keys[high[(key >> (shift + bits)) & mask]++] = key;
}

/// Completes the order of keys that are sorted by their bits from `shift` on: sorts the keys that are equal in these
/// bits, of which few are expected.
void order_ties(std::span<std::uint64_t> keys, int shift) {
  for (std::size_t i = 1; i < keys.size(); ++i) {
    if (keys[i] >= keys[i - 1]) continue;
    const std::uint64_t tie = keys[i] >> shift;
    std::size_t first = i - 1, last = i + 1;
    while (first > 0 && keys[first - 1] >> shift == tie) --first;
    while (last < keys.size() && keys[last] >> shift == tie) ++last;
    std::sort(keys.begin() + static_cast<std::ptrdiff_t>(first), keys.begin() + static_cast<std::ptrdiff_t>(last));
    i = last;
  }
}

/// Sorts keys that are equal in all bits from shift + bits on. The result is in `keys`.
void sort_keys(std::span<std::uint64_t> keys, std::span<std::uint64_t> scratch, int shift, int bits) {
  if (keys.size() < kTooFewForRadix) {
    std::sort(keys.begin(), keys.end());
    return;
  }
  // After an even number of passes the result is in the first array.
  const int passes = (bits + 2 * kMaxDigitBits - 1) / (2 * kMaxDigitBits) * 2;
  const int digit = passes > 0 ? (bits + passes - 1) / passes : 0;
  for (int i = 0; i < passes; i += 2) two_passes(keys, scratch, shift + i * digit, digit);
  order_ties(keys, shift);
}

}  // namespace

/// Collects the keys of a range in `keys`, sorted.
void EventSorter::sort_range(std::span<PackedEvents> parts, std::size_t range, std::span<std::uint64_t> keys,
                             std::span<std::uint64_t> scratch, int time_shift) {
  if (keys.empty()) return;
  std::uint64_t* next = keys.data();
  for (const PackedEvents& part : parts) next = std::ranges::copy(part.range(range), next).out;
  // The bits of the time in which the keys differ.
  std::uint64_t differing = 0;
  for (const std::uint64_t key : keys) differing |= key ^ keys[0];
  sort_keys(keys, scratch, time_shift, std::max(0, static_cast<int>(std::bit_width(differing)) - time_shift));
}

void EventSorter::sort(std::span<PackedEvents> parts, const Workers& workers, EventBuffer& sorted) {
  std::array<std::size_t, PackedEvents::kRanges + 1> begins{};
  for (std::size_t range = 0; range < PackedEvents::kRanges; ++range) {
    begins[range + 1] = begins[range];
    for (const PackedEvents& part : parts) begins[range + 1] += part.range(range).size();
  }
  const std::size_t count = begins.back();
  Event* const out = sorted.make_room(count);
  if (count == 0) return;
  if (keys_.size() < count) keys_.resize(2 * count), scratch_.resize(2 * count);

  const EventPacking packing = parts.front().packing();
  const auto sort_one = [&](int i) {
    const auto range = static_cast<std::size_t>(i);
    const std::size_t begin = begins[range], size = begins[range + 1] - begin;
    const std::span keys = std::span(keys_).subspan(begin, size);
    sort_range(parts, range, keys, std::span(scratch_).subspan(begin, size), packing.time_shift());
    for (std::size_t k = 0; k < size; ++k) packing.unpack(keys[k], out[begin + k]);
  };
  constexpr std::size_t kTooFewToShare = 1024;
  constexpr int kRanges = static_cast<int>(PackedEvents::kRanges);
  if (count < kTooFewToShare) {
    for (int range = 0; range < kRanges; ++range) sort_one(range);
  } else {
    workers.for_each(kRanges, sort_one);
  }
  for (PackedEvents& part : parts) part.clear();
}

}  // namespace esim::inline events
