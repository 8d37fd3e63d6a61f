#pragma once

#include <span>
#include <string>
#include <vector>

#include "esim/plot/ticks.h"

namespace esim::inline plot {

/// One axis of a diagram: values from low to high, evenly spaced or, if logarithmic, in their logarithm.
struct Scale {
  double low = 0, high = 1;  ///< low < high; above 0 if logarithmic
  bool logarithmic = false;
  std::string title{};  ///< quantity and unit: "time (s)"
  LabelStyle style = LabelStyle::numbers;
  std::vector<Tick> names{};  ///< instead of numbers, if not empty

  /// 0 at low, 1 at high; outside [0, 1] beyond them.
  double position(double value) const;
  /// The value at a position.
  double value(double position) const;

  Ticks ticks(int wanted) const;
};

/// A scale from low to high; around them if they are (almost) equal.
Scale linear_scale(double low, double high, std::string title, LabelStyle style = LabelStyle::numbers);
Scale logarithmic_scale(double low, double high, std::string title, LabelStyle style = LabelStyle::numbers);

/// A scale from 0 to the number of names; the first is at the upper end, each in the middle of its interval.
Scale name_scale(std::span<const std::string> names);

}  // namespace esim::inline plot
