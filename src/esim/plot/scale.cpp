#include "esim/plot/scale.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace esim::inline plot {

double Scale::position(double value) const {
  if (!logarithmic) return (value - low) / (high - low);
  constexpr double kFarBelow = -1e3;
  return value > 0 ? std::log(value / low) / std::log(high / low) : kFarBelow;
}

double Scale::value(double position) const {
  return logarithmic ? low * std::pow(high / low, position) : low + position * (high - low);
}

Ticks Scale::ticks(int wanted) const {
  if (!names.empty()) return {names, {}, {}, {}};
  return logarithmic ? logarithmic_ticks(low, high, wanted, style) : linear_ticks(low, high, wanted, style);
}

Scale linear_scale(double low, double high, std::string title, LabelStyle style) {
  constexpr double kDistinct = 1e-11;
  const double largest = std::max(std::abs(low), std::abs(high));
  if (std::abs(high - low) <= kDistinct * largest || largest < 1e-280) {
    const double room = largest < 1e-280 ? 1.0 : 0.5 * largest;
    return {low - room, high + room, false, std::move(title), style};
  }
  return {std::min(low, high), std::max(low, high), false, std::move(title), style};
}

Scale logarithmic_scale(double low, double high, std::string title, LabelStyle style) {
  constexpr double kMinRatio = 1.001, kRoom = 3;
  if (low > high) std::swap(low, high);
  if (low > 0 && high < kMinRatio * low) return {low / kRoom, high * kRoom, true, std::move(title), style};
  return {low, high, true, std::move(title), style};
}

Scale name_scale(std::span<const std::string> names) {
  Scale scale{0, std::max(1.0, static_cast<double>(names.size())), false};
  for (std::size_t i = 0; i < names.size(); ++i)
    scale.names.push_back({static_cast<double>(names.size() - i) - 0.5, names[i]});
  return scale;
}

}  // namespace esim::inline plot
