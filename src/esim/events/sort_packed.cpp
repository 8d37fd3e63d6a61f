#include "esim/events/sort_packed.h"

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

}  // namespace

void sort_packed(std::span<std::uint64_t> events, std::span<std::uint64_t> scratch, const EventPacking& packing) {
  if (events.size() < kTooFewForRadix) {
    std::sort(events.begin(), events.end());
    return;
  }
  std::uint64_t differing = 0;
  for (const std::uint64_t event : events) differing |= event ^ events[0];
  const int shift = packing.time_shift();
  const int bits = std::max(0, static_cast<int>(std::bit_width(differing)) - shift);
  // After an even number of passes the result is in the first array.
  const int passes = (bits + 2 * kMaxDigitBits - 1) / (2 * kMaxDigitBits) * 2;
  const int digit = passes > 0 ? (bits + passes - 1) / passes : 0;
  for (int i = 0; i < passes; i += 2) two_passes(events, scratch, shift + i * digit, digit);
  order_ties(events, shift);
}

}  // namespace esim::inline events
