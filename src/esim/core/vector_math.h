#pragma once

#include <hwy/highway.h>
//
#include <hwy/contrib/math/math-inl.h>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>

// Functions on vectors of values.
// Private to .cpp files: includes hwy/highway.h.
namespace esim::inline core {

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

/// Whether all values are valid irradiances: finite numbers >= 0. Their bits, as unsigned integers, are at most those
/// of the largest float; adding zero converts minus zero.
template <class D>
class IrradianceCheck {
 public:
  explicit IrradianceCheck(D) : largest_(hn::Zero(hn::RebindToUnsigned<D>())) {}

  HWY_INLINE void see(D d, hn::Vec<D> values) {
    largest_ = hn::Max(largest_, hn::BitCast(hn::RebindToUnsigned<D>(), hn::Add(values, hn::Zero(d))));
  }
  bool passed() const {
    constexpr std::uint32_t kLargest = std::bit_cast<std::uint32_t>(std::numeric_limits<float>::max());
    return hn::GetLane(hn::MaxOfLanes(hn::RebindToUnsigned<D>(), largest_)) <= kLargest;
  }

 private:
  hn::Vec<hn::RebindToUnsigned<D>> largest_;
};

/// ln(x) for x > 0, finite and not denormal, to one or two units in the last place of a float.
template <class D>
HWY_INLINE hn::Vec<D> logarithm(D d, hn::Vec<D> x) {
  // x = 2^n (1 + f) with 1 + f between sqrt(1/2) and sqrt(2); ln(1 + f) = f - f^2 / 2 + f^3 times a minimax polynomial.
  const hn::RebindToSigned<D> di;
  const auto bits = hn::BitCast(di, x);
  const auto n = hn::ShiftRight<23>(hn::Sub(bits, hn::Set(di, 0x3f3504f3)));
  const auto f = hn::Sub(hn::BitCast(d, hn::Sub(bits, hn::ShiftLeft<23>(n))), hn::Set(d, 1.0F));
  const auto f2 = hn::Mul(f, f), f4 = hn::Mul(f2, f2), whole = hn::ConvertTo(d, n);
  const auto pair = [&](float first, float second) { return hn::MulAdd(f, hn::Set(d, second), hn::Set(d, first)); };
  const auto p03 = hn::MulAdd(pair(0.200012269F, -0.166233574F), f2, pair(0.333333317F, -0.25000821F));
  const auto p47 = hn::MulAdd(pair(0.127615781F, -0.0763449927F), f2, pair(0.142017578F, -0.131601819F));
  const auto cubic = hn::Mul(hn::Mul(f2, f), hn::MulAdd(p47, f4, p03));
  const auto small = hn::MulAdd(whole, hn::Set(d, -2.12194440e-4F), hn::NegMulAdd(hn::Set(d, 0.5F), f2, cubic));
  return hn::MulAdd(whole, hn::Set(d, 0.693359375F), hn::Add(f, small));
}

/// 1 - exp(-u) for u >= 0, to a few units in the last place of a float.
template <class D>
HWY_INLINE hn::Vec<D> moved_after(D d, hn::Vec<D> u) {
  // u = n ln 2 - r with |r| <= ln 2 / 2; then 1 - exp(-u) = (1 - 2^-n) - 2^-n (exp(r) - 1). After adding 1.5 * 2^23,
  // the lowest bits of the float hold n.
  const hn::RebindToSigned<D> di;
  const auto rounder = hn::Set(d, 12582912.0F), one = hn::Set(d, 1.0F);
  u = hn::Min(u, hn::Set(d, 60.0F));  // beyond this the result is 1
  const auto rounded = hn::MulAdd(u, hn::Set(d, 1.44269504F), rounder), n = hn::Sub(rounded, rounder);
  const auto r = hn::MulSub(n, hn::Set(d, 0.693359375F), hn::MulAdd(n, hn::Set(d, 2.12194440e-4F), u));
  const auto r2 = hn::Mul(r, r);
  const auto p01 = hn::MulAdd(r, hn::Set(d, 1.0F / 6), hn::Set(d, 0.5F));
  const auto p23 = hn::MulAdd(r, hn::Set(d, 1.0F / 120), hn::Set(d, 1.0F / 24));
  const auto p45 = hn::MulAdd(r, hn::Set(d, 1.0F / 5040), hn::Set(d, 1.0F / 720));
  const auto tail = hn::MulAdd(hn::MulAdd(p45, r2, p23), r2, p01);
  const auto grown = hn::MulAdd(tail, r2, r);
  const auto scale = hn::BitCast(d, hn::Sub(hn::BitCast(di, one), hn::ShiftLeft<23>(hn::BitCast(di, rounded))));
  return hn::NegMulAdd(scale, grown, hn::Sub(one, scale));
}

/// The same in doubles, to a dozen digits.
template <class D>
HWY_INLINE hn::Vec<D> precisely_moved_after(D d, hn::Vec<D> u) {
  const hn::RebindToSigned<D> di;
  const auto rounder = hn::Set(d, 0x1.8p52), one = hn::Set(d, 1.0);
  u = hn::Min(u, hn::Set(d, 60.0));
  const auto rounded = hn::MulAdd(u, hn::Set(d, 1.4426950408889634), rounder), n = hn::Sub(rounded, rounder);
  const auto r = hn::MulSub(n, hn::Set(d, 0.69314718055994531), u), r2 = hn::Mul(r, r), r4 = hn::Mul(r2, r2);
  const auto pair = [&](double first, double second) { return hn::MulAdd(r, hn::Set(d, second), hn::Set(d, first)); };
  const auto p03 = hn::MulAdd(pair(1.0 / 24, 1.0 / 120), r2, pair(1.0 / 2, 1.0 / 6));
  const auto p47 = hn::MulAdd(pair(1.0 / 40320, 1.0 / 362880), r2, pair(1.0 / 720, 1.0 / 5040));
  const auto p89 = pair(1.0 / 3628800, 1.0 / 39916800);
  const auto grown = hn::MulAdd(hn::MulAdd(hn::MulAdd(p89, r4, p47), r4, p03), r2, r);
  const auto scale = hn::BitCast(d, hn::Sub(hn::BitCast(di, one), hn::ShiftLeft<52>(hn::BitCast(di, rounded))));
  return hn::NegMulAdd(scale, grown, hn::Sub(one, scale));
}

/// Cosine and sine of 2 pi `turns`, for turns between 0 and 1, to a few units in the last place of 1.
template <class D>
HWY_INLINE void cosine_and_sine(D d, hn::Vec<D> turns, hn::Vec<D>& cosine, hn::Vec<D>& sine) {
  // Minimax polynomials within an eighth of a turn of n quarters of a turn; the lowest bits hold n.
  const hn::RebindToSigned<D> di;
  const auto rounder = hn::Set(d, 12582912.0F), rounded = hn::MulAdd(turns, hn::Set(d, 4.0F), rounder);
  const auto x = hn::NegMulAdd(hn::Sub(rounded, rounder), hn::Set(d, 0.25F), turns), x2 = hn::Mul(x, x);
  const auto pair = [&](float first, float second) { return hn::MulAdd(x2, hn::Set(d, second), hn::Set(d, first)); };
  const auto x4 = hn::Mul(x2, x2);
  const auto s = hn::Mul(x, hn::MulAdd(pair(81.5923536F, -75.3935628F), x4, pair(6.28318529F, -41.3416615F)));
  const auto c67 = hn::MulAdd(hn::Set(d, 59.2027961F), x4, pair(64.9393107F, -85.442298F));
  const auto c = hn::MulAdd(c67, x4, pair(1.0F, -19.7392086F));
  // Odd quarters swap the two; the second and third change the cosine's sign, the third and fourth the sine's.
  const auto n = hn::BitCast(di, rounded);
  const auto odd = hn::RebindMask(d, hn::Ne(hn::And(n, hn::Set(di, 1)), hn::Zero(di)));
  const auto sign_of = [&](auto quarter) {
    return hn::BitCast(d, hn::ShiftLeft<30>(hn::And(quarter, hn::Set(di, 2))));
  };
  cosine = hn::Xor(hn::IfThenElse(odd, s, c), sign_of(hn::Add(n, hn::Set(di, 1))));
  sine = hn::Xor(hn::IfThenElse(odd, c, s), sign_of(n));
}

/// For each set of eight lanes, given as bits: the lanes in the set, in order, then the others.
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

/// Up to eight lanes of 32 bits; selects the lanes of a mask without a branch. (With g++ 12, Highway's CompressStore
/// copies its table to the stack for each call.)
template <class D>
class ChosenLanes {
 public:
  explicit ChosenLanes(std::uint8_t bits)
      : lanes_(
            hn::PromoteTo(hn::RebindToUnsigned<D>(), hn::LoadU(hn::Rebind<std::uint8_t, D>(), kLanesOf[bits].data()))),
        count_(static_cast<std::size_t>(std::popcount(bits))) {
    static_assert(hn::MaxLanes(D()) <= 8);
  }
  ChosenLanes(D d, hn::Mask<D> mask) : ChosenLanes(bits_of(d, mask)) {}

  /// One bit for each lane of the mask.
  static std::uint8_t bits_of(D d, hn::Mask<D> mask) {
    std::array<std::uint8_t, 8> bits;
    hn::StoreMaskBits(d, mask, bits.data());
    return bits[0];
  }

  std::size_t count() const { return count_; }

  /// Writes first + lane for each chosen lane, in order, possibly followed by other values.
  void store_positions(std::uint32_t first, std::uint32_t* out) const {
    const hn::RebindToUnsigned<D> du;
    hn::StoreU(hn::Add(lanes_, hn::Set(du, first)), du, out);
  }

 private:
  hn::Vec<hn::RebindToUnsigned<D>> lanes_;
  std::size_t count_;
};

}  // namespace esim::inline core
