#pragma once

#include <string>
#include <vector>

namespace esim::inline plot {

/// A labelled position on an axis.
struct Tick {
  double value = 0;
  std::string label;
};

struct Ticks {
  std::vector<Tick> major;    ///< in increasing order, all within the range
  std::vector<double> minor;  ///< without labels
  std::string factor;         ///< of the labels, for the axis's title: "×10⁶"; empty: 1
  std::string offset;         ///< added to the labels: "1600000000"; empty: 0
};

enum class LabelStyle {
  numbers,
  full,        ///< without a common factor and offset
  magnitudes,  ///< without signs
  seconds,     ///< on logarithmic axes: 1 µs, 10 µs, 1 ms
};

/// Multiples of 1, 2 or 5 times a power of ten within [low, high]: of the steps that give 3 to 10 of them, the smallest
/// that gives at most `wanted`. Throws an Error unless low < high are finite, and distinct enough for ticks.
Ticks linear_ticks(double low, double high, int wanted = 6, LabelStyle style = LabelStyle::numbers);

/// 1, 2 and 5 times powers of ten within [low, high], or the powers, or every second, fifth, ... of them, so that there
/// are 3 to 10, if possible at most `wanted`; minor ticks between them. linear_ticks() if the range has fewer than
/// three of the first. Throws an Error unless 0 < low < high are finite, and distinct enough for ticks.
Ticks logarithmic_ticks(double low, double high, int wanted = 6, LabelStyle style = LabelStyle::numbers);

}  // namespace esim::inline plot
