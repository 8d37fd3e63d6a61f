#include "esim/characterise/response.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "esim/characterise/normal_distribution.h"
#include "esim/core/error.h"
#include "esim/stats/numerics/minimise.h"

namespace esim::inline characterise {
namespace {

using Complex = std::complex<double>;

constexpr double kLargestAmplitude = 5;  // ln

double bandwidth_of(double t1_s, double t2_s) {
  double low = 0, high = 1 / (t1_s + t2_s);
  while (gain(high, t1_s, t2_s) > std::numbers::sqrt2 / 2) high *= 2;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (gain(middle, t1_s, t2_s) > std::numbers::sqrt2 / 2 ? low : high) = middle;
  }
  return low;
}

/// The amplitude of a sinusoid whose response reaches the threshold at its maximum, to second order: with x = L - y
/// of the photodiode, dy/dt = (x + x^2 / 2) / t1. `sign`: +1 for a maximum above, -1 for a minimum below.
double amplitude_of(double frequency_hz, double t1_s, double t2_s, double threshold, double sign) {
  const double w = 2 * std::numbers::pi * frequency_hz;
  const auto pole = [&](double order, double t_s) { return 1.0 / Complex(1, order * w * t_s); };
  const Complex first = pole(1, t1_s) * pole(1, t2_s), lag = 1.0 - pole(1, t1_s);
  const Complex second = lag * lag * pole(2, t1_s) * pole(2, t2_s);
  // At the extremum of the first order, exp(i w t) = sign conj(first) / |first|.
  const Complex turn = std::conj(first) / std::abs(first);
  const double shift = 0.25 * (std::norm(lag) + (second * turn * turn).real());
  // |first| A + sign shift A^2 = threshold
  const double slope = std::abs(first);
  const double discriminant = slope * slope + 4 * sign * shift * threshold;
  return 2 * threshold / (slope + std::sqrt(std::max(0.0, discriminant)));
}

}  // namespace

double ResponseTimes::effective(double contrast, double lux) const {
  return std::log((lux * std::exp(contrast) + dark_lux) / (lux + dark_lux));
}

double ResponseTimes::bandwidth_hz(double lux) const { return bandwidth_of(t1_s(lux), t2_s); }

double gain(double frequency_hz, double t1_s, double t2_s) {
  const double w = 2 * std::numbers::pi * frequency_hz;
  return 1 / std::sqrt((1 + w * w * t1_s * t1_s) * (1 + w * w * t2_s * t2_s));
}

double step_latency_s(double contrast, double threshold, double t1_s, double t2_s) {
  if (std::abs(contrast) <= threshold) return std::numeric_limits<double>::infinity();
  const double sign = contrast > 0 ? 1 : -1, rise = std::expm1(contrast);
  const auto diode = [&](double t) { return sign * (contrast - std::log1p(rise * std::exp(-t / t1_s))); };
  // v' = (y - v) / t2, y linear on each step; steps are short for the fastest time constant and grow with time.
  double t = 0, v = 0;
  const double first_step = 1e-3 * std::min(t2_s, t1_s * std::exp(-std::max(0.0, -contrast)));
  for (double step = first_step; t < 200 * (t1_s + t2_s); step = std::max(first_step, 1e-3 * t)) {
    const double y0 = diode(t), y1 = diode(t + step), a = step / t2_s, decay = std::exp(-a);
    const double ramp = (y1 - y0) / a;
    const double next = y1 - ramp + (v - y0 + ramp) * decay;
    if (next >= threshold) return t + step * (threshold - v) / (next - v);
    v = next;
    t += step;
  }
  return std::numeric_limits<double>::infinity();
}

CumulativeNormal fit_cumulative_normal(const TrialCounts& counts) {
  const std::vector<double>& contrasts = counts.protocol.contrasts;
  const std::size_t levels = contrasts.size();
  std::vector<double> fired(levels), trials(levels);
  for (std::size_t i = 0; i < counts.trials.size(); ++i)
    fired[i % levels] += counts.fired[i], trials[i % levels] += counts.trials[i];
  // The start: where the fractions pass one half.
  double low = std::numeric_limits<double>::infinity(), high = 0, largest = 0;
  for (std::size_t k = 0; k < levels; ++k) {
    const double size = std::abs(contrasts[k]);
    largest = std::max(largest, size);
    if (2 * fired[k] >= trials[k])
      low = std::min(low, size);
    else
      high = std::max(high, size);
  }
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  if (std::isinf(low) || high == 0) return {kNaN, kNaN};
  const auto loss = [&](const std::vector<double>& p) {
    double sum = 0;
    for (std::size_t k = 0; k < levels; ++k) {
      const double z = (std::abs(contrasts[k]) - p[0]) / std::exp(p[1]);
      sum -= fired[k] * std::log(std::max(1e-12, normal_cdf(z)));
      sum -= (trials[k] - fired[k]) * std::log(std::max(1e-12, normal_cdf(-z)));
    }
    return sum;
  };
  const double centre = 0.5 * (low + high);
  const auto best = minimise(loss, {centre, std::log(0.1 * centre)}, {0.05 * centre, 0.5});
  return {best[0], std::exp(best[1])};
}

Bandwidth measure_bandwidth(const SensorUnderTest& sensor, const TrialProtocol& steps,
                            std::span<const double> frequencies_hz, double threshold_guess) {
  Bandwidth result;
  const double sign = steps.contrasts.empty() || steps.contrasts.front() > 0 ? 1 : -1;
  double guess = threshold_guess;
  for (const double frequency_hz : frequencies_hz) {
    TrialProtocol sines = steps;
    sines.frequency_hz = frequency_hz;
    CumulativeNormal fit;
    for (const double reach : {2.0, 1.15}) {  // first the size, then the fit
      sines.contrasts.clear();
      for (int i = -4; i <= 4; ++i) sines.contrasts.push_back(sign * guess * std::pow(reach, 0.25 * i));
      fit = fit_cumulative_normal(measure(sensor, sines));
      guess = std::abs(fit.centre);
      if (!(guess > 0 && guess < kLargestAmplitude)) {
        throw UserError(
            fmt::format("no amplitude of sinusoids of {:.3g} Hz makes half of the pixels respond; noise is too near to "
                        "the threshold",
                        frequency_hz));
      }
    }
    result.points.push_back({frequency_hz, guess});
  }
  const auto loss = [&](const std::vector<double>& p) {
    double sum = 0;
    for (const AmplitudePoint& point : result.points) {
      const double expected = amplitude_of(point.frequency_hz, std::exp(p[0]), std::exp(p[1]), std::exp(p[2]), sign);
      sum += std::pow(std::log(point.amplitude / expected), 2);
    }
    return sum;
  };
  const double fastest = *std::max_element(frequencies_hz.begin(), frequencies_hz.end());
  const auto best =
      minimise(loss, {std::log(0.3 / fastest), std::log(0.1 / fastest), std::log(result.points.front().amplitude)},
               {0.5, -0.5, 0.1}, 1e-6);
  result.t1_s = std::exp(std::max(best[0], best[1]));
  result.t2_s = std::exp(std::min(best[0], best[1]));
  result.threshold = std::exp(best[2]);
  result.bandwidth_hz = bandwidth_of(result.t1_s, result.t2_s);
  return result;
}

ResponseTimes fit_latencies(std::span<const LatencyPoint> points, double contrast, double threshold, double dark_lux) {
  const auto loss = [&](const std::vector<double>& p) {
    const ResponseTimes times{std::exp(p[0]), std::exp(p[1]), dark_lux};
    double sum = 0;
    for (const LatencyPoint& point : points) {
      const double effective = times.effective(contrast, point.lux);
      const double expected =
          step_latency_s(effective, threshold, times.t1_s(point.lux * std::exp(contrast)), times.t2_s);
      sum += std::pow(std::log(point.latency_s / expected), 2);
    }
    return sum;
  };
  const auto [dim, bright] =
      std::minmax_element(points.begin(), points.end(), [](const auto& a, const auto& b) { return a.lux < b.lux; });
  const auto best =
      minimise(loss, {std::log(dim->latency_s * (dim->lux + dark_lux)), std::log(bright->latency_s)}, {0.5, 0.5}, 1e-5);
  return {std::exp(best[0]), std::exp(best[1]), dark_lux};
}

}  // namespace esim::inline characterise
