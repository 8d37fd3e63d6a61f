#pragma once

#include <array>
#include <cstddef>

namespace esim::inline fit {

/// An equation of docs/methods/fitting.md, section 1, has the unknowns C+, C-, leak of its pixel; D, d, o of all
/// pixels; and L.
inline constexpr int kOfPixel = 3, kShared = 3, kUnknowns = kOfPixel + kShared;
inline constexpr std::size_t kEquationSize = kUnknowns + 1;
using Equation = std::array<double, kEquationSize>;

/// The sums of products of two of these values each, by rows.
using EquationProducts = std::array<double, kEquationSize*(kEquationSize + 1) / 2>;

}  // namespace esim::inline fit
