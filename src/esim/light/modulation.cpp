#include "esim/light/modulation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "esim/core/error.h"

namespace esim::inline light {
namespace {

constexpr double kPi = std::numbers::pi;

constexpr double kBrightest = 100;  // irradiance up to which the tolerance holds
constexpr double kShortestPulse_s = 10e-9;

/// Throws UserError unless all options are in their ranges.
const FlickerOptions& checked(const FlickerOptions& o, const std::string& key) {
  const auto require = [&](const char* option, double value, bool valid, const char* rule) {
    if (!valid) throw UserError(fmt::format("{}.{}: must be {}, not {}", key, option, rule, value));
  };
  require("frequency_hz", o.frequency_hz, o.frequency_hz > 0 && o.frequency_hz <= 1e6, "above 0 and at most 1e6 Hz");
  require("depth", o.depth, o.depth >= 0 && o.depth <= 1, "between 0 and 1");
  require("phase", o.phase, o.phase >= 0 && o.phase <= 1, "between 0 and 1");
  require("duty", o.duty, o.duty >= 0 && o.duty <= 1, "between 0 and 1");
  if (o.shape != FlickerShape::pwm) return o;
  require("duty", o.duty, o.duty > 0 && o.duty < 1, "above 0 and below 1");
  const double shortest_s = std::min(o.duty, 1 - o.duty) / o.frequency_hz;
  if (shortest_s < kShortestPulse_s) {
    throw UserError(fmt::format(
        "{}.duty: {} at {} Hz gives pulses or gaps of {:.3g} ns, but they must last at least {:.0f} ns; lower "
        "frequency_hz or change duty",
        key, o.duty, o.frequency_hz, shortest_s * 1e9, kShortestPulse_s * 1e9));
  }
  return o;
}

/// Mean over a period of the part of the light that varies between 0 and 1.
double mean_of(const FlickerOptions& o) {
  switch (o.shape) {
    case FlickerShape::mains:
      return 2 / kPi;
    case FlickerShape::sine:
      return 0.5;
    case FlickerShape::pwm:
      break;
  }
  return o.duty;
}

/// Antiderivatives over the phase p in [0, 1), from 0: `first` of the part that varies minus its mean, `second` of
/// `first` minus its mean. Both are periodic.
struct Antiderivatives {
  double first, mean_of_first, second;
};

Antiderivatives antiderivatives(const FlickerOptions& o, double p) {
  const double d = o.duty;
  switch (o.shape) {
    case FlickerShape::mains:
      return {(1 - std::cos(kPi * p) - 2 * p) / kPi, 0, (p - p * p - std::sin(kPi * p) / kPi) / kPi};
    case FlickerShape::sine:
      return {-std::sin(2 * kPi * p) / (4 * kPi), 0, (std::cos(2 * kPi * p) - 1) / (8 * kPi * kPi)};
    case FlickerShape::pwm:
      break;
  }
  const double mean = d * (1 - d) / 2;
  if (p < d) return {p * (1 - d), mean, (1 - d) * p * p / 2 - mean * p};
  return {d * (1 - p), mean, (1 - d) * d * d / 2 + d * (p - d - (p * p - d * d) / 2) - mean * p};
}

double fraction(double value) { return value - std::floor(value); }

}  // namespace

Modulation::Modulation(const FlickerOptions& options, TimeNs start, const LightAccuracy& accuracy,
                       const std::string& key)
    : options_(checked(options, key)), start_(start) {
  // Times of files may be large numbers: long double keeps their phase.
  const long double at_start = static_cast<long double>(start) * 1e-9L * options.frequency_hz + options.phase;
  phase_ = static_cast<double>(at_start - std::floor(at_start));
  scale_ = 1 / (1 - options.depth + options.depth * mean_of(options));
  if (options.shape == FlickerShape::pwm) {
    nodes_ = {0, options.duty};
  } else {
    place_nodes(accuracy);
  }
}

double Modulation::periods(TimeNs t) const { return phase_ + to_seconds(t - start_) * options_.frequency_hz; }

TimeNs Modulation::time_of(double periods) const { return start_ + to_ns((periods - phase_) / options_.frequency_hz); }

/// The part of the light that varies, between 0 and 1.
double Modulation::shape(double phase) const {
  switch (options_.shape) {
    case FlickerShape::mains:
      return std::sin(kPi * phase);
    case FlickerShape::sine:
      return 0.5 - 0.5 * std::cos(2 * kPi * phase);
    case FlickerShape::pwm:
      break;
  }
  return phase < options_.duty ? 1 : 0;
}

double Modulation::at(TimeNs t) const {
  return scale_ * (1 - options_.depth + options_.depth * shape(fraction(periods(t))));
}

Modulation::Integrals Modulation::integrals(TimeNs t0, TimeNs t1) const {
  const Antiderivatives a = antiderivatives(options_, fraction(periods(t0)));
  const Antiderivatives b = antiderivatives(options_, fraction(periods(t1)));
  const double duration = to_seconds(t1 - t0), period = 1 / options_.frequency_hz;
  const double first = period * b.first;
  const double second = period * (b.mean_of_first * duration + period * (b.second - a.second));
  const double depth = scale_ * options_.depth;  // m = 1 + depth (g - mean of g)
  return {duration + depth * (first - period * a.first), duration * duration / 2 + depth * (duration * first - second)};
}

/// A bound on the second derivative of ln(m + d) by the phase, for any d >= `dark`.
double Modulation::curvature(double phase, double dark) const {
  const bool mains = options_.shape == FlickerShape::mains;
  const double angle = (mains ? 1 : 2) * kPi * phase;
  const double slope = kPi * (mains ? std::cos(angle) : std::sin(angle));
  const double bend = mains ? kPi * kPi * std::sin(angle) : 2 * kPi * kPi * std::cos(angle);
  const double m = scale_ * (1 - options_.depth + options_.depth * shape(phase)) + dark;
  const double relative = scale_ * options_.depth / m;
  return std::abs(bend) * relative + slope * slope * relative * relative;
}

/// Smooth shapes: as many nodes as the tolerance requires.
void Modulation::place_nodes(const LightAccuracy& accuracy) {
  const double dark = accuracy.dark / kBrightest;
  const double shortest = std::max(1e-12, 0.5e-9 * options_.frequency_hz);  // half a nanosecond
  const auto longest_for = [&](double most) { return std::sqrt(8 * accuracy.tolerance / most); };
  const auto step_from = [&](double phase) {
    double step = std::min(0.5, longest_for(curvature(phase, dark)));
    while (step > shortest) {
      const double most = std::max(curvature(phase + step / 2, dark), curvature(phase + step, dark));
      if (step <= longest_for(most)) break;
      step *= 0.9;
    }
    return std::max(step, shortest);
  };
  // The second half of a period mirrors the first.
  std::vector<double> half;
  for (double phase = 0; phase < 0.5; phase += step_from(phase)) half.push_back(phase);
  nodes_ = half;
  nodes_.push_back(0.5);
  for (std::size_t i = half.size(); i-- > 1;) nodes_.push_back(1 - half[i]);
}

/// The first nanosecond at which a switched light is on, or off, near a time given in periods.
TimeNs Modulation::edge(double periods, bool on) const {
  const auto is_on = [&](TimeNs t) { return shape(fraction(this->periods(t))) > 0; };
  TimeNs t = time_of(periods);
  while (is_on(t) != on) ++t;
  while (is_on(t - 1) == on) --t;
  return t;
}

TimeNs Modulation::next_node(TimeNs t) const {
  if (options_.depth == 0) return std::numeric_limits<TimeNs>::max();
  double period = std::floor(periods(t)) - 1;
  const double within = fraction(periods(t));
  auto i = static_cast<std::size_t>(std::upper_bound(nodes_.begin(), nodes_.end(), within) - nodes_.begin());
  // From the node before t on, since rounding to nanoseconds may move it after t.
  if (i > 0) {
    --i, ++period;
  } else {
    i = nodes_.size() - 1;
  }
  while (true) {
    const double node = period + nodes_[i];
    if (options_.shape == FlickerShape::pwm) {
      const TimeNs after = edge(node, i == 0);
      if (after - 1 > t) return after - 1;
      if (after > t) return after;
    } else {
      const TimeNs rounded = time_of(node);
      if (rounded > t) return rounded;
    }
    if (++i == nodes_.size()) i = 0, ++period;
  }
}

}  // namespace esim::inline light
