#pragma once

#include <hwy/highway.h>
//
#include <hwy/contrib/math/math-inl.h>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

// What is done with many values at once. Private: only .cpp files include it.
namespace esim {

namespace hn = hwy::HWY_NAMESPACE;

/// values[i] = f(d, values[i]) for whole vectors that cover `count` elements.
template <typename T, typename Function>
void for_vectors(std::size_t count, T* values, const Function& f) {
  const hn::ScalableTag<T> d;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) hn::StoreU(f(d, hn::LoadU(d, values + i)), d, values + i);
}

inline void logarithms(std::size_t count, double* values) {
  for_vectors(count, values, [](auto d, auto x) { return hn::Log(d, x); });
}

inline void exponentials(std::size_t count, float* values) {
  for_vectors(count, values, [](auto d, auto x) { return hn::Exp(d, x); });
}

/// For each set of eight lanes, as bits, the lanes in it, in order, then others.
inline constexpr auto kLanesOf = [] {
  std::array<std::array<std::uint8_t, 8>, 256> lanes{};
  for (std::size_t bits = 0; bits < 256; ++bits) {
    std::size_t count = 0;
    for (std::uint8_t lane = 0; lane < 8; ++lane) {
      if ((bits >> lane & 1U) != 0) lanes[bits][count++] = lane;
    }
  }
  return lanes;
}();

/// Up to eight lanes of 32 bits, those of a mask chosen without a branch. (Highway's CompressStore copies its table
/// to the stack for each call with g++ 12.)
template <class D>
class ChosenLanes {
 public:
  ChosenLanes(D d, hn::Mask<D> mask) {
    static_assert(hn::MaxLanes(D()) <= 8);
    std::uint64_t bits = 0;
    hn::StoreMaskBits(d, mask, reinterpret_cast<std::uint8_t*>(&bits));
    count_ = static_cast<std::size_t>(std::popcount(bits));
    lanes_ = hn::PromoteTo(hn::RebindToUnsigned<D>(), hn::LoadU(hn::Rebind<std::uint8_t, D>(), kLanesOf[bits].data()));
  }

  std::size_t count() const { return count_; }

  /// Writes first + step * lane for each chosen lane, in order, and maybe more behind. The step is 1 or 2.
  void store_positions(std::uint32_t first, int step, std::uint32_t* out) const {
    const hn::RebindToUnsigned<D> du;
    hn::StoreU(hn::Add(step == 2 ? hn::Add(lanes_, lanes_) : lanes_, hn::Set(du, first)), du, out);
  }

  /// Writes the values of the chosen lanes, in order, and maybe more behind.
  void store(hn::Vec<D> values, float* out) const {
    const D d;
    hn::StoreU(hn::TableLookupLanes(values, hn::IndicesFromVec(d, lanes_)), d, out);
  }

 private:
  hn::Vec<hn::RebindToUnsigned<D>> lanes_;
  std::size_t count_;
};

}  // namespace esim
