// The camera's own elementary functions, compared with the library's in doubles.
#include "esim/core/vector_math.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace esim {
namespace {

/// Calls check(x, f(x)) for many x, where f is a function of vectors.
template <typename T, typename Function, typename Check>
void for_many(const Function& f, const Check& check, T first, T factor, T step) {
  const hn::CappedTag<T, 8> d;
  std::array<T, 8> x{}, y{};
  T next = first;
  for (int i = 0; i < 20000; ++i) {
    for (T& value : x) value = next, next = next * factor + step;
    for (std::size_t k = 0; k < 8; k += hn::Lanes(d)) hn::StoreU(f(d, hn::LoadU(d, x.data() + k)), d, y.data() + k);
    for (std::size_t k = 0; k < 8; ++k) check(static_cast<double>(x[k]), static_cast<double>(y[k]));
  }
}

TEST(VectorMath, LogarithmHasTheDigitsOfAFloat) {
  double worst = 0;
  for_many<float>([](auto d, auto x) { return logarithm(d, x); },
                  [&](double x, double y) {
                    const double exact = std::log(x);
                    worst = std::max(worst, std::fabs(y - exact) / std::max(std::fabs(exact), 1e-6));
                  },
                  1e-37F, 1.001F, 0.0F);
  EXPECT_LT(worst, 1.5e-7);
}

TEST(VectorMath, HowFarAPoleMovesHasTheDigitsOfItsType) {
  double worst = 0, worst_precise = 0;
  const auto relative = [](double u, double moved) { return std::fabs(moved / -std::expm1(-u) - 1); };
  for_many<float>([](auto d, auto u) { return moved_after(d, u); },
                  [&](double u, double moved) { worst = std::max(worst, relative(u, moved)); }, 1e-12F, 1.0003F, 0.0F);
  for_many<double>([](auto d, auto u) { return precisely_moved_after(d, u); },
                   [&](double u, double moved) { worst_precise = std::max(worst_precise, relative(u, moved)); }, 1e-12,
                   1.0003, 0.0);
  EXPECT_LT(worst, 2e-7);
  EXPECT_LT(worst_precise, 1e-13);
}

TEST(VectorMath, CosineAndSineAreThoseOfTurns) {
  double worst = 0;
  const auto compare = [&](double exact, double y) { worst = std::max(worst, std::fabs(y - exact)); };
  const auto part = [](bool sine) {
    return [sine](auto d, auto turns) {
      hn::Vec<decltype(d)> c, s;
      cosine_and_sine(d, turns, c, s);
      return sine ? s : c;
    };
  };
  const float step = 1.0F / 160000;
  for_many<float>(
      part(false), [&](double x, double y) { compare(std::cos(2 * std::numbers::pi * x), y); }, 0.0F, 1.0F, step);
  for_many<float>(
      part(true), [&](double x, double y) { compare(std::sin(2 * std::numbers::pi * x), y); }, 0.0F, 1.0F, step);
  EXPECT_LT(worst, 2.5e-7);
}

}  // namespace
}  // namespace esim
