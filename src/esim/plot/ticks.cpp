#include "esim/plot/ticks.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>

#include "esim/core/error.h"
#include "esim/plot/text.h"

namespace esim::inline plot {
namespace {

constexpr int kFewestTicks = 3, kMostTicks = 10;
constexpr std::array<int, 3> kMantissas = {1, 2, 5};
constexpr double kRounding = 1e-9;  // of a step

/// integer times 10^exponent, correctly rounded where the power of ten is exact.
double scaled(double integer, int exponent) {
  if (exponent < -300) return integer * std::pow(10.0, -300) / std::pow(10.0, -exponent - 300);
  return exponent < 0 ? integer / std::pow(10.0, -exponent) : integer * std::pow(10.0, exponent);
}

/// A step between ticks: mantissa times 10^exponent.
struct Step {
  int mantissa = 1, exponent = 0;
  double value() const { return scaled(mantissa, exponent); }
  Step next() const { return mantissa == 5 ? Step{1, exponent + 1} : Step{mantissa == 1 ? 2 : 5, exponent}; }
};

/// The multiples of a step within a range.
struct Multiples {
  Multiples(double low, double high, const Step& step)
      : first(std::ceil(low / step.value() - kRounding)), last(std::floor(high / step.value() + kRounding)) {}
  double count() const { return last - first + 1; }
  double first, last;
};

Step choose_step(double low, double high, int wanted) {
  wanted = std::clamp(wanted, kFewestTicks, kMostTicks);
  Step step{1, static_cast<int>(std::floor(std::log10((high - low) / kMostTicks))) - 1};
  std::optional<Step> chosen;
  for (;; step = step.next()) {
    const double count = Multiples(low, high, step).count();
    if (count < kFewestTicks) return *chosen;  // a step of 3 to 10 ticks comes before, since steps grow by at most 2.5
    if (count > kMostTicks) continue;
    chosen = step;
    if (count <= wanted) return step;
  }
}

std::string decimal(double value, int decimals) {
  const std::string text = fmt::format("{:.{}f}", std::abs(value), decimals);
  const bool is_zero = text.find_first_not_of("0.") == std::string::npos;
  return value < 0 && !is_zero ? "−" + text : text;
}

std::string power_of_ten(int exponent) { return "10" + superscript(exponent); }

void require_range(double low, double high) {
  const double largest = std::max(std::abs(low), std::abs(high));
  if (!std::isfinite(high - low) || !(high - low > 1e-12 * largest) || high - low < 1e-290)
    throw Error(fmt::format("an axis must extend from a number to a larger one, not from {} to {}", low, high));
}

std::string mantissa_label(int mantissa, int exponent, bool plain) {
  if (plain) return fmt::format("{:g}", scaled(mantissa, exponent));
  return mantissa == 1 ? power_of_ten(exponent) : fmt::format("{}×{}", mantissa, power_of_ten(exponent));
}

std::string seconds_label(int mantissa, int exponent) {
  constexpr std::array<const char*, 4> kUnits = {"ns", "µs", "ms", "s"};
  if (exponent < -9 || exponent > 3) return mantissa_label(mantissa, exponent, false) + " s";
  const int group = std::min(static_cast<int>(std::floor(exponent / 3.0)), 0);
  return fmt::format("{:g} {}", scaled(mantissa, exponent - 3 * group), kUnits[static_cast<std::size_t>(group + 3)]);
}

/// A tick of a logarithmic axis.
struct LogTick {
  int mantissa, exponent;
  double value() const { return scaled(mantissa, exponent); }
};

/// The marks within a range, in increasing order; powers of ten only at multiples of `every`.
std::vector<LogTick> marks(double low, double high, int every, std::span<const int> mantissas) {
  std::vector<LogTick> all;
  const int first = static_cast<int>(std::floor(std::log10(low))) - 1,
            last = static_cast<int>(std::ceil(std::log10(high)));
  for (int exponent = first; exponent <= last; ++exponent) {
    if (exponent % every != 0) continue;
    for (const int mantissa : mantissas) {
      const LogTick mark{mantissa, exponent};
      if (mark.value() >= low * (1 - kRounding) && mark.value() <= high * (1 + kRounding)) all.push_back(mark);
    }
  }
  return all;
}

struct ChosenMarks {
  std::vector<LogTick> major, minor;
};

/// The marks with the largest number up to `wanted`; empty if there are fewer than three.
ChosenMarks choose_marks(double low, double high, int wanted) {
  wanted = std::clamp(wanted, kFewestTicks, kMostTicks);
  constexpr std::array<int, 1> kOne = {1};
  constexpr std::array<int, 9> kAll = {1, 2, 3, 4, 5, 6, 7, 8, 9};
  ChosenMarks chosen;
  const auto is_enough = [&](std::vector<LogTick> major, std::vector<LogTick> minor) {
    if (major.size() < kFewestTicks) return true;  // so are all coarser ones
    if (major.size() <= kMostTicks) chosen = {std::move(major), std::move(minor)};
    return !chosen.major.empty() && chosen.major.size() <= static_cast<std::size_t>(wanted);
  };
  if (is_enough(marks(low, high, 1, kMantissas), marks(low, high, 1, kAll))) return chosen;
  for (Step every{1, 0}; every.exponent < 3; every = every.next()) {
    const int step = static_cast<int>(every.value());
    std::vector<LogTick> minor = step == 1 ? marks(low, high, 1, kAll) : marks(low, high, 1, kOne);
    if (is_enough(marks(low, high, step, kOne), std::move(minor))) break;
  }
  return chosen;
}

}  // namespace

Ticks linear_ticks(double low, double high, int wanted, LabelStyle style) {
  require_range(low, high);
  const Step step = choose_step(low, high, wanted);
  const Multiples multiples(low, high, step);
  const auto size_of = [&](double first, double last) {
    return std::max(std::abs(first), std::abs(last)) * step.value();
  };
  const bool is_short = style != LabelStyle::full;
  Ticks ticks;
  // Of values with more than six digits, the common first ones are an offset: a multiple of 10 to 100 steps.
  double offset = 0;
  if (is_short && std::max(std::abs(multiples.first), std::abs(multiples.last)) * step.mantissa >= 1e6) {
    const double round = 100.0 / step.mantissa;
    offset = std::floor(multiples.first / round) * round;
    ticks.offset = decimal(scaled(offset * step.mantissa, step.exponent), std::max(0, -step.exponent - 2));
  }
  const double largest = size_of(multiples.first - offset, multiples.last - offset);
  int factor = 0;
  constexpr int kMaxDecimals = 6;
  if (is_short && (largest >= 1e5 || largest < 1e-2 || -step.exponent > kMaxDecimals))
    factor = 3 * static_cast<int>(std::floor(std::log10(largest) / 3 + kRounding));
  if (factor != 0) ticks.factor = "×" + power_of_ten(factor);
  const int decimals = std::max(0, factor - step.exponent);
  for (double i = multiples.first; i <= multiples.last; ++i) {
    const double label = scaled((i - offset) * step.mantissa, step.exponent - factor);
    ticks.major.push_back({std::clamp(scaled(i * step.mantissa, step.exponent), low, high),
                           decimal(style == LabelStyle::magnitudes ? std::abs(label) : label, decimals)});
  }
  return ticks;
}

Ticks logarithmic_ticks(double low, double high, int wanted, LabelStyle style) {
  require_range(low, high);
  if (!(low > 0)) throw Error(fmt::format("a logarithmic axis must begin above 0, not at {}", low));
  const ChosenMarks chosen = choose_marks(low, high, wanted);
  if (chosen.major.empty()) {
    Ticks ticks = linear_ticks(low, high, wanted, style);
    if (style == LabelStyle::seconds) {
      for (Tick& tick : ticks.major) tick.label += " s";
    }
    return ticks;
  }
  Ticks ticks;
  const bool plain = chosen.major.front().exponent >= -3 && chosen.major.back().exponent <= 4;
  for (const LogTick& mark : chosen.major) {
    ticks.major.push_back({std::clamp(mark.value(), low, high),
                           style == LabelStyle::seconds ? seconds_label(mark.mantissa, mark.exponent)
                                                        : mantissa_label(mark.mantissa, mark.exponent, plain)});
  }
  for (const LogTick& mark : chosen.minor) {
    const bool is_major = std::any_of(chosen.major.begin(), chosen.major.end(), [&](const LogTick& other) {
      return other.mantissa == mark.mantissa && other.exponent == mark.exponent;
    });
    if (!is_major) ticks.minor.push_back(std::clamp(mark.value(), low, high));
  }
  return ticks;
}

}  // namespace esim::inline plot
