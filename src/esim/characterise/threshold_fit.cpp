#include "esim/characterise/threshold_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "esim/characterise/normal_distribution.h"
#include "esim/core/error.h"
#include "esim/stats/numerics/minimise.h"

namespace esim::inline characterise {
namespace {

// Gauss-Hermite: E f(n) = sum of weights f(x) for a standard normal n.
constexpr std::array<double, 9> kNormalAt{
    -4.512745863399783, -3.205429002856470, -2.076847978677830, -1.023255663789133, 0.0,
    1.023255663789133,  2.076847978677830,  3.205429002856470,  4.512745863399783};
constexpr std::array<double, 9> kNormalWeights{2.234584400774658e-5, 2.789141321231769e-3, 4.991640676521788e-2,
                                               2.440975028949394e-1, 4.063492063492063e-1, 2.440975028949394e-1,
                                               4.991640676521788e-2, 2.789141321231769e-3, 2.234584400774658e-5};

constexpr int kThresholds = 41;  // of the distribution of pixels, within kReach standard deviations
constexpr double kReach = 4;

/// The noise of a pixel in the light after a step, and the step response.
struct Noise {
  double t1_s, t2_s, deviation;

  /// The rate r / Phi at which noise crosses a level z standard deviations above its mean, where the level falls by
  /// `fall` standard deviations of the noise per second.
  double hazard(double z, double fall) const {
    const double middle_s = std::sqrt(t1_s * t2_s), m = fall * middle_s;
    if (z < -6) return std::max(0.0, -z) * (m * normal_cdf(m) + normal_pdf(m)) / middle_s;
    // Crossings come in clusters, which was measured with simulated noise; a level that falls fast is crossed once.
    const double w = std::max(2.2, z) * middle_s / (t1_s + t2_s);
    const double clusters = 1 / (1 + 0.165 * -std::expm1(-4 * w) / (w * w));
    const double single = clusters + (1 - clusters) * std::min(1.0, m * m);
    return single * normal_pdf(z) * (normal_pdf(m) + m * normal_cdf(m)) / (middle_s * normal_cdf(z));
  }

  double response(double t) const {
    return 1 - (t1_s * std::exp(-t / t1_s) - t2_s * std::exp(-t / t2_s)) / (t1_s - t2_s);
  }
  double slope(double t) const { return (std::exp(-t / t1_s) - std::exp(-t / t2_s)) / (t1_s - t2_s); }
};

Noise noise_of(const PixelEstimate& estimate, double lux) {
  double t1_s = estimate.times.t1_s(lux);
  const double t2_s = estimate.times.t2_s;
  if (std::abs(t1_s / t2_s - 1) < 1e-3) t1_s = 1.001 * t2_s;  // no division by zero
  return {t1_s, t2_s, std::sqrt(t1_s / (estimate.charge_e * (t1_s + t2_s)))};
}

/// -log of the likelihood of all pixels of a recording.
double loss_of(const TrialCounts& counts, const PixelEstimate& estimate) {
  const std::size_t levels = counts.protocol.contrasts.size();
  std::vector<double> log_yes(kThresholds * levels), log_no(kThresholds * levels), weights(kThresholds);
  double all = 0;
  for (std::size_t j = 0; j < kThresholds; ++j) {
    const double deviations = kReach * (2.0 * static_cast<double>(j) / (kThresholds - 1) - 1);
    weights[j] = normal_pdf(deviations);
    all += weights[j];
    const double threshold = estimate.threshold + deviations * estimate.mismatch;
    for (std::size_t k = 0; k < levels; ++k) {
      const double p = std::clamp(
          response_probability(counts.protocol, counts.protocol.contrasts[k], threshold, estimate), 1e-9, 1 - 1e-9);
      log_yes[j * levels + k] = std::log(p);
      log_no[j * levels + k] = std::log1p(-p);
    }
  }
  double loss = 0;
  std::array<double, kThresholds> logs{};
  for (std::size_t pixel = 0; pixel < counts.pixels; ++pixel) {
    for (std::size_t j = 0; j < kThresholds; ++j) {
      logs[j] = std::log(weights[j] / all);
      for (std::size_t k = 0; k < levels; ++k) {
        const double fired = counts.fired[pixel * levels + k], trials = counts.trials[pixel * levels + k];
        logs[j] += fired * log_yes[j * levels + k] + (trials - fired) * log_no[j * levels + k];
      }
    }
    const double largest = *std::max_element(logs.begin(), logs.end());
    double sum = 0;
    for (const double value : logs) sum += std::exp(value - largest);
    loss -= largest + std::log(sum);
  }
  return loss;
}

}  // namespace

double PixelEstimate::noise(double lux) const {
  return std::sqrt(times.t1_s(lux) / (charge_e * (times.t1_s(lux) + times.t2_s)));
}

double PixelEstimate::photocurrent_fa_per_lux() const {
  return charge_e * CircuitOptions::kElementaryCharge_fC / times.t1_lux_s;
}

double response_probability(const TrialProtocol& steps, double contrast, double threshold,
                            const PixelEstimate& estimate) {
  constexpr int kIntervals = 12;  // of the response to the step; afterwards, the level is constant
  const double effective = std::abs(estimate.times.effective(contrast, steps.lux));
  const Noise noise = noise_of(estimate, steps.lux * std::exp(contrast));
  const double before = estimate.noise(steps.lux);
  const double settled_s = std::min(steps.window_s, 6 * (noise.t1_s + noise.t2_s));
  double silent = 0;
  for (std::size_t i = 0; i < kNormalAt.size(); ++i) {
    const double level = threshold + before * kNormalAt[i];
    const auto hazard = [&](double t) {
      return noise.hazard((level - effective * noise.response(t)) / noise.deviation,
                          effective * noise.slope(t) / noise.deviation);
    };
    double expected = (steps.window_s - settled_s) * hazard(settled_s);
    for (int k = 0; k < kIntervals && expected < 40; ++k)
      expected += settled_s / kIntervals * hazard(settled_s * (k + 0.5) / kIntervals);
    silent += kNormalWeights[i] * std::exp(-expected);
  }
  return 1 - silent;
}

PixelEstimate fit_steps(std::span<const TrialCounts> recordings, const ResponseTimes& times,
                        const FitOptions& options) {
  PixelEstimate start;
  start.times = times;
  double brightest = 0;
  for (const TrialCounts& counts : recordings) {
    const CumulativeNormal curve = fit_cumulative_normal(counts);
    if (!std::isfinite(curve.centre)) {
      throw UserError(
          fmt::format("the contrasts at {:.3g} lux are all below the threshold or all above it; choose "
                      "contrasts on both sides",
                      counts.protocol.lux));
    }
    if (counts.protocol.lux < brightest) continue;
    brightest = counts.protocol.lux;
    const double reach = std::abs(curve.centre), spread = std::max(0.02 * reach, curve.deviation);
    start.threshold = reach + spread;
    start.mismatch = 0.5 * spread;
    const double t1_s = times.t1_s(brightest);
    start.charge_e = t1_s / (0.25 * spread * spread * (t1_s + times.t2_s));
  }
  const auto estimate_of = [&](const std::vector<double>& p) {
    PixelEstimate estimate = start;
    estimate.threshold = std::exp(p[0]);
    estimate.mismatch = std::exp(p[1]);
    estimate.charge_e = std::exp(p[2]);
    if (options.dark_current) estimate.times.dark_lux = std::exp(p[3]);
    return estimate;
  };
  std::vector<double> at{std::log(start.threshold), std::log(start.mismatch), std::log(start.charge_e)};
  std::vector<double> steps{0.05, 0.5, 0.5};
  if (options.dark_current) {
    double dimmest = brightest;
    for (const TrialCounts& counts : recordings) dimmest = std::min(dimmest, counts.protocol.lux);
    at.push_back(std::log(times.dark_lux > 0 ? times.dark_lux : dimmest));
    steps.push_back(0.3);
  }
  const auto loss = [&](const std::vector<double>& p) {
    const PixelEstimate estimate = estimate_of(p);
    double sum = 0;
    for (const TrialCounts& counts : recordings) sum += loss_of(counts, estimate);
    return sum;
  };
  return estimate_of(minimise(loss, at, steps, 2e-3));
}

}  // namespace esim::inline characterise
