#pragma once

#include <hwy/highway.h>
//
#include <hwy/contrib/math/math-inl.h>

#include <cstddef>

// Elementary functions of many values at once. Private: only .cpp files include it.
namespace esim {

namespace hn = hwy::HWY_NAMESPACE;

/// Arrays that are worked on in whole vectors have room for one more.
inline constexpr std::size_t kVectorPadding = 16;

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

}  // namespace esim
