#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include "esim/core/time.h"

namespace esim::inline stats {

/// A hash that spreads consecutive numbers over all 64 bits: SplitMix64 (Steele et al., OOPSLA 2014).
constexpr std::uint64_t hash_index(std::uint64_t index) {
  std::uint64_t z = (index + 1) * 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

/// Time stamps of all events or, for more than a million events, of a random sample that contains each event with
/// probability 2^-k: the events whose index has a hash with at least k trailing zeros. The sample depends only on the
/// indices.
class TimeSample {
 public:
  static constexpr std::size_t kCapacity = 1 << 20;

  void add(TimeNs t) {
    const int zeros = trailing_zeros(index_++);
    if (zeros < min_zeros_) return;
    if (times_.size() == kCapacity) thin();
    if (zeros < min_zeros_) return;
    times_.push_back(t);
    zeros_.push_back(static_cast<std::uint8_t>(zeros));
  }

  const std::vector<TimeNs>& times() const { return times_; }

 private:
  static int trailing_zeros(std::uint64_t index) { return std::countr_zero(hash_index(index)); }
  void thin();

  std::uint64_t index_ = 0;
  int min_zeros_ = 0;
  std::vector<TimeNs> times_;
  std::vector<std::uint8_t> zeros_;  // trailing zeros of each hash
};

}  // namespace esim::inline stats
