#pragma once

#include <hwy/highway.h>

/// The weights with which a texture is averaged along one axis.
namespace esim::inline scene {

// Widths of boxes are given as squares, in texels: 12 times the variance.
inline constexpr float kWidestBox2 = 3.2F * 3.2F;
inline constexpr float kNarrowBox2 =
    0.4F * 0.4F;  // up to this square width, only the two taps in the middle have weights

template <class V>
struct FourOf {
  V first, second, third, fourth;
};

/// Four taps that show a box and the bilinear interpolation between texels. Their weights are functions of the position
/// t between the two in the middle:
///     outer(t), 1 - t - 2 outer(t) + outer(1 - t), t - 2 outer(1 - t) + outer(t), outer(1 - t),
///     with outer(t) = (1 - t) (o0 + o1 t + o2 t^2). Their sum is 1, and their centre is t.
///
/// Among weights >= 0 that keep linear functions, they are the least squares of the exact response up to half a period
/// per texel and a width of 2.6, cubic in t and with powers 1 to 4 of the width. Up to a width of 3.2 they stay >= 0.
template <class D>
class BoxFilter {
 public:
  using V = hwy::HWY_NAMESPACE::Vec<D>;

  /// `blur`: the part of the square width that the texels already have.
  HWY_INLINE BoxFilter(D d, V width2, V blur) : d_(d) {
    namespace hn = hwy::HWY_NAMESPACE;
    const auto set = [d](float x) { return hn::Set(d, x); };
    const V narrow = hn::MulSub(width2, set(1 / (1 - kNarrowBox2)), set(kNarrowBox2 / (1 - kNarrowBox2)));
    const V m = hn::Min(hn::Max(hn::Min(hn::Sub(width2, blur), narrow), hn::Zero(d)), set(kWidestBox2));
    const V w = hn::Sqrt(m);
    const auto polynomial = [&](float a, float b, float c, float e) {
      return hn::Mul(w, hn::MulAdd(m, hn::MulAdd(w, set(e), set(c)), hn::MulAdd(w, set(b), set(a))));
    };
    o0_ = polynomial(0.066560656F, 0.104233191F, -0.054449860F, 0.008588901F);
    o1_ = polynomial(-0.414436499F, -0.273083886F, 0.370888349F, -0.082152291F);
    o2_ = polynomial(0.668923652F, -0.228000202F, -0.184483805F, 0.067919584F);
  }

  HWY_INLINE FourOf<V> weights(V t) const {
    namespace hn = hwy::HWY_NAMESPACE;
    const V rest = hn::Sub(hn::Set(d_, 1.0F), t);
    const auto outer = [&](V x, V other) { return hn::Mul(other, hn::MulAdd(x, hn::MulAdd(x, o2_, o1_), o0_)); };
    const V first = outer(t, rest), fourth = outer(rest, t), difference = hn::Sub(fourth, first);
    return {first, hn::Add(hn::Sub(rest, first), difference), hn::Sub(hn::Sub(t, fourth), difference), fourth};
  }

 private:
  [[no_unique_address]] D d_;
  V o0_, o1_, o2_;
};

}  // namespace esim::inline scene
