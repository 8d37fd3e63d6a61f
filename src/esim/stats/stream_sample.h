#pragma once

#include <bit>
#include <cstddef>
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

/// The items of a stream or, of more than a million, a random sample that contains each with probability 2^-k: those
/// whose index has a hash with at least k trailing zeros. The sample depends only on the indices; its items keep their
/// order.
template <class T>
class StreamSample {
 public:
  static constexpr std::size_t kCapacity = 1 << 20;

  void add(const T& item) {
    const int zeros = std::countr_zero(hash_index(index_++));
    if (zeros < min_zeros_) return;
    if (items_.size() == kCapacity) thin();
    if (zeros < min_zeros_) return;
    items_.push_back(item);
    zeros_.push_back(static_cast<std::uint8_t>(zeros));
  }

  const std::vector<T>& items() const { return items_; }

 private:
  void thin() {
    ++min_zeros_;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < items_.size(); ++i) {
      if (zeros_[i] < min_zeros_) continue;
      items_[kept] = items_[i];
      zeros_[kept++] = zeros_[i];
    }
    items_.resize(kept);
    zeros_.resize(kept);
  }

  std::uint64_t index_ = 0;
  int min_zeros_ = 0;
  std::vector<T> items_;
  std::vector<std::uint8_t> zeros_;  // trailing zeros of each hash
};

/// Time stamps of all events, or of a random sample of them.
using TimeSample = StreamSample<TimeNs>;

}  // namespace esim::inline stats
