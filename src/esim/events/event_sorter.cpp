#include "esim/events/event_sorter.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <utility>

namespace esim {
namespace {

constexpr int kMaxDigitBits = 11;
constexpr std::size_t kRanges = 16;           // of time, sorted in parallel
constexpr std::size_t kTooFewToShare = 2048;  // events
constexpr std::size_t kTooFewForRadix = 64;

using Counts = std::array<std::uint32_t, std::size_t{1} << kMaxDigitBits>;

/// Positions of the buckets from the numbers in them.
void add_up(Counts& counts, std::size_t buckets) {
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < buckets; ++i) sum += std::exchange(counts[i], sum);
}

/// Two stable passes of a radix sort, by `bits` bits from `shift` on and as many above: from `keys` and back.
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

/// Orders keys whose bits from `shift` on, `bits` of them, are ordered: those that are equal there, few of which are
/// expected.
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

/// Sorts keys that agree in all bits from shift + bits on. The result is in `keys`.
void sort_keys(std::span<std::uint64_t> keys, std::span<std::uint64_t> scratch, int shift, int bits) {
  if (keys.size() < kTooFewForRadix) {
    std::sort(keys.begin(), keys.end());
    return;
  }
  // An even number of passes ends where it began.
  const int passes = (bits + 2 * kMaxDigitBits - 1) / (2 * kMaxDigitBits) * 2;
  const int digit = passes > 0 ? (bits + passes - 1) / passes : 0;
  for (int i = 0; i < passes; i += 2) two_passes(keys, scratch, shift + i * digit, digit);
  order_ties(keys, shift);
}

}  // namespace

/// Brings the keys of all parts together in keys_: into `ranges` ranges of the bits from `shift` on, which begin at
/// begins_.
void EventSorter::scatter(std::span<std::vector<std::uint64_t>> parts, int shift, std::size_t ranges,
                          std::uint64_t first, const Workers& workers) {
  const auto range_of = [&](std::uint64_t key) { return (key >> shift) - first; };
  const int part_count = static_cast<int>(parts.size());
  positions_.assign(parts.size() * ranges, 0);
  const auto positions_of = [&](int part) { return positions_.data() + static_cast<std::size_t>(part) * ranges; };
  if (ranges > 1) {
    workers.for_each(part_count, [&](int part) {
      std::uint32_t* const position = positions_of(part);
      for (const std::uint64_t key : parts[static_cast<std::size_t>(part)]) ++position[range_of(key)];
    });
  } else {
    for (int part = 0; part < part_count; ++part) {
      positions_of(part)[0] = static_cast<std::uint32_t>(parts[static_cast<std::size_t>(part)].size());
    }
  }

  begins_.assign(ranges + 1, 0);
  std::uint32_t sum = 0;
  for (std::size_t range = 0; range < ranges; ++range) {
    begins_[range] = sum;
    for (int part = 0; part < part_count; ++part) sum += std::exchange(positions_of(part)[range], sum);
  }
  begins_[ranges] = sum;
  workers.for_each(part_count, [&](int part) {
    std::uint32_t* const position = positions_of(part);
    std::vector<std::uint64_t>& keys = parts[static_cast<std::size_t>(part)];
    if (ranges > 1) {
      for (const std::uint64_t key : keys) keys_[position[range_of(key)]++] = key;
    } else {
      std::copy(keys.begin(), keys.end(), keys_.begin() + position[0]);
    }
    keys.clear();
  });
}

void EventSorter::sort(std::span<std::vector<std::uint64_t>> parts, const EventPacking& packing, const Workers& workers,
                       EventBuffer& sorted) {
  std::size_t count = 0, filled = 0;
  std::vector<std::uint64_t>* last_filled = nullptr;
  for (auto& part : parts) {
    count += part.size();
    if (!part.empty()) ++filled, last_filled = &part;
  }
  Event* const out = sorted.make_room(count);
  if (count == 0) return;
  if (scratch_.size() < count) scratch_.resize(2 * count);

  // How many bits of the time do they differ in?
  const std::uint64_t some = last_filled->front();
  std::uint64_t differing = 0;
  for (const auto& part : parts) {
    for (const std::uint64_t key : part) differing |= key ^ some;
  }
  const int bits = std::max(0, static_cast<int>(std::bit_width(differing)) - packing.time_shift());
  if (filled == 1 && workers.threads() == 1) {
    sort_keys(*last_filled, scratch_, packing.time_shift(), bits);
    for (std::size_t i = 0; i < count; ++i) packing.unpack((*last_filled)[i], out[i]);
    last_filled->clear();
    return;
  }

  if (keys_.size() < count) keys_.resize(2 * count);
  const bool share = workers.threads() > 1 && count >= kTooFewToShare;
  const int range_bits = share ? std::min(bits, static_cast<int>(std::bit_width(kRanges)) - 1) : 0;
  const int sorted_bits = bits - range_bits;
  const int shift = packing.time_shift() + sorted_bits;
  const std::size_t ranges = std::size_t{1} << range_bits;
  scatter(parts, shift, ranges, (some >> shift) & ~(static_cast<std::uint64_t>(ranges) - 1), workers);

  workers.for_each(static_cast<int>(ranges), [&](int range) {
    const std::size_t begin = begins_[static_cast<std::size_t>(range)];
    const std::size_t size = begins_[static_cast<std::size_t>(range) + 1] - begin;
    const std::span keys = std::span(keys_).subspan(begin, size);
    sort_keys(keys, std::span(scratch_).subspan(begin, size), packing.time_shift(), sorted_bits);
    for (std::size_t i = 0; i < size; ++i) packing.unpack(keys[i], out[begin + i]);
  });
}

}  // namespace esim
