#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "esim/fit/estimate.h"

namespace esim::inline fit {

/// The sensor in 8 x 8 areas.
class AreaGrid {
 public:
  static constexpr int kAlong = 8;
  AreaGrid(int width, int height) : width_(width), height_(height) {}
  std::size_t areas() const { return std::size_t{kAlong} * kAlong; }
  std::size_t of(int x, int y) const {
    return static_cast<std::size_t>(kAlong * (y * kAlong / height_) + x * kAlong / width_);
  }

 private:
  int width_, height_;
};

inline constexpr std::ptrdiff_t kFewestAreas = 10;

/// A value with its standard error.
struct Jackknifed {
  double value = 0, error = 0, quantile = 0;
  double low() const { return value - quantile * error; }
  double high() const { return value + quantile * error; }
};

/// Evaluates with all areas, and without each area that is used: with the m values v_k without area k and their mean v,
/// the error is sqrt((m - 1) / m sum (v_k - v)^2). Neighbouring pixels may depend on each other. Nothing with fewer
/// than kFewestAreas areas.
std::optional<std::vector<Jackknifed>> jackknife(
    const std::vector<bool>& used, const std::function<std::vector<double>(std::optional<std::size_t>)>& evaluate);

/// `part` of `all` independent pixels, with Wilson's interval (JASA 22, 1927); not determined without pixels.
Estimate fraction_estimate(const char* name, std::uint64_t part, std::uint64_t all, const char* source);

}  // namespace esim::inline fit
