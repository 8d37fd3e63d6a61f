#include "esim/characterise/characterisation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <mutex>
#include <numbers>

#include "esim/characterise/response.h"
#include "esim/core/error.h"
#include "esim/core/parallel.h"
#include "esim/stats/event_statistics.h"

namespace esim::inline characterise {
namespace {

constexpr double kBrightest_lux = 1e5, kDarkest_lux = 1e-4;
constexpr double kMaxContrast = 4;         // ln; no S-curve beyond
constexpr double kRefractoryPeriods = 10;  // response times
const double kDoubled = std::numbers::ln2;

/// The sum of the time constants before a pixel's comparators, s, which fixes how long the bench waits.
double response_time_s(const EventCameraOptions& sensor, double lux) {
  constexpr double kShortest = 1e-4;
  if (const auto& c = sensor.circuit) {
    const double current = c->photocurrent_fa_per_lux * lux + c->dark_current_fa;
    return kShortest + c->photodiode_s(current) + c->source_follower_s();
  }
  const double low_pass_s =
      sensor.low_pass_hz > 0 ? sensor.low_pass_order / (2 * std::numbers::pi * sensor.low_pass_hz) : 0.0;
  const double dark = sensor.dark_irradiance;
  const double slower = (1 + dark) / (lux + dark);  // low-pass and latency are those at white
  return kShortest + low_pass_s * slower +
         1e-6 * (sensor.latency_us + sensor.latency_jitter_us) * std::max(1.0, slower);
}

/// The contrast of the light that makes a contrast of the photocurrents.
double contrast_of_light(const EventCameraOptions& sensor, double contrast, double lux) {
  const auto& c = sensor.circuit;
  const double dark = c ? c->dark_current_fa / c->photocurrent_fa_per_lux : sensor.log_eps;
  return std::log1p(std::expm1(contrast) * (1 + dark / lux));
}

/// The bench for a sensor at one illuminance.
class Bench {
 public:
  Bench(const EventCameraOptions& sensor, const CharacterisationOptions& options, double lux)
      : options_(options), sensor_(sensor), lux_(lux), response_s_(response_time_s(sensor, lux)) {
    sensor_.refractory_period_us = std::max(sensor.refractory_period_us, 1e6 * kRefractoryPeriods * response_s_);
    sensor_.refractory_mode = RefractoryMode::hold;
  }

  TrialCounts steps(std::vector<double> contrasts, int repeats, double change_s = 1e-6) {
    TrialProtocol protocol = protocol_for(std::move(contrasts), repeats);
    protocol.change_s = change_s;
    protocol.window_s += change_s;
    return measure(bench(sensor_), protocol);
  }

  /// The bandwidth is that of small signals, so that the thresholds are lowered as far as the scatter of an S-curve
  /// allows. `curve`: of ON events at the sensor's own threshold.
  Bandwidth bandwidth(const SCurve& curve) {
    constexpr double kSmall = 0.06;
    const double threshold = std::min(curve.threshold, std::max(kSmall, 6 * curve.width));
    EventCameraOptions lowered = sensor_;
    lowered.contrast_threshold_on = sensor_.threshold_on() * threshold / curve.threshold;
    lowered.contrast_threshold_off = sensor_.threshold_off();  // not below that of ON
    if (sensor_.threshold_off() < sensor_.threshold_on()) {
      lowered.contrast_threshold_off = *lowered.contrast_threshold_on;
    }
    std::vector<double> frequencies;
    for (const double factor : {0.25, 0.7, 1.4, 2.5})
      frequencies.push_back(factor / (2 * std::numbers::pi * response_s_));
    return measure_bandwidth(bench(lowered), protocol_for({1}, 1), frequencies, threshold);
  }

  double response_s() const { return response_s_; }

 private:
  TrialProtocol protocol_for(std::vector<double> contrasts, int repeats) const {
    return TrialProtocol::steps(lux_, std::move(contrasts), repeats, response_s_, 1e-6 * sensor_.refractory_period_us);
  }
  SensorUnderTest bench(const EventCameraOptions& sensor) {
    return simulated_sensor(sensor, options_.width, options_.height, options_.seed + ++recordings_);
  }

  const CharacterisationOptions& options_;
  EventCameraOptions sensor_;
  double lux_, response_s_;
  std::uint64_t recordings_ = 0;
};

/// The scatter of the pixels' own thresholds. That of a pixel is the sum over the contrasts of the fraction of trials
/// without a response times the step to the next contrast (Spearman and Kaerber), which is unbiased.
double non_uniformity(const TrialCounts& counts) {
  const std::vector<double>& contrasts = counts.protocol.contrasts;
  double n = 0, sum = 0, squares = 0, noise = 0;
  for (std::size_t pixel = 0; pixel < counts.pixels; ++pixel) {
    double threshold = std::abs(contrasts.front()), variance = 0;
    bool complete = true;
    for (std::size_t k = 0; k + 1 < contrasts.size(); ++k) {
      const std::size_t i = pixel * contrasts.size() + k;
      const double trials = counts.trials[i], step = std::abs(contrasts[k + 1] - contrasts[k]);
      complete &= trials >= 2;
      if (!complete) break;
      const double missed = 1 - counts.fired[i] / trials;
      threshold += missed * step;
      variance += missed * (1 - missed) / (trials - 1) * step * step;
    }
    if (!complete) continue;
    n += 1, sum += threshold, squares += threshold * threshold, noise += variance;
  }
  if (n < 2) return std::numeric_limits<double>::quiet_NaN();
  return std::sqrt(std::max(0.0, (squares - sum * sum / n) / (n - 1) - noise / n));
}

std::vector<double> spread(double from, double to, int count) {
  std::vector<double> values;
  for (int k = 0; k < count; ++k) values.push_back(from + (to - from) * k / (count - 1));
  return values;
}

/// First in a wide range about the expected threshold, then where the responses change.
SCurve s_curve(Bench& bench, double expected, double sign, int repeats, double change_s = 1e-6) {
  constexpr int kFirst = 13, kContrasts = 17;
  SCurve curve;
  const double step = expected * 1.8 / (kFirst - 1);
  curve.contrasts = spread(sign * 0.2 * expected, sign * 2 * expected, kFirst);
  TrialCounts counts = bench.steps(curve.contrasts, 2, change_s);
  CumulativeNormal fit = fit_cumulative_normal(counts);
  if (std::isfinite(fit.centre)) {
    const double centre = std::abs(fit.centre), reach = std::max(step, 3.5 * fit.deviation);
    curve.contrasts = spread(sign * std::max(0.1 * centre, centre - reach), sign * (centre + reach), kContrasts);
    counts = bench.steps(curve.contrasts, repeats, change_s);
    fit = fit_cumulative_normal(counts);
  }
  for (std::size_t k = 0; k < curve.contrasts.size(); ++k) curve.fractions.push_back(counts.fraction(k));
  if (!std::isfinite(fit.centre)) throw UserError("noise responds to most trials, whatever the contrast");
  curve.threshold = std::abs(fit.centre), curve.width = fit.deviation;
  curve.non_uniformity = non_uniformity(counts);
  return curve;
}

void measure_latency(Bench& bench, int repeats, LightLevel& level) {
  const TrialCounts counts = bench.steps({kDoubled}, repeats);
  level.latency_s = counts.median_latency_s(0);
  std::vector<double> times = counts.latencies_s[0];
  if (!std::isfinite(level.latency_s)) throw UserError("fewer than half of the pixels respond to doubled light");
  std::sort(times.begin(), times.end());
  const auto at = [&](double p) { return times[static_cast<std::size_t>(p * static_cast<double>(times.size() - 1))]; };
  level.jitter_s = 0.5 * (at(0.84) - at(0.16));
}

LightLevel measure_level(const EventCameraOptions& sensor, const CharacterisationOptions& options, double lux) {
  LightLevel level;
  level.lux = lux;
  Bench bench(sensor, options, lux);
  const auto attempt = [&](const char* what, const auto& measurement) {
    try {
      measurement();
    } catch (const UserError& error) {
      level.notes.push_back(fmt::format("{} at {:g} lux: {}", what, lux, error.what()));
    }
  };
  const double on = contrast_of_light(sensor, sensor.threshold_on(), lux);
  const double off = -contrast_of_light(sensor, -sensor.threshold_off(), lux);
  if (2 * on < kMaxContrast) {
    attempt("S-curve, ON", [&] { level.on = s_curve(bench, on, 1, options.repeats); });
    attempt("S-curve of ramps",
            [&] { level.on_ramp = s_curve(bench, on, 1, options.repeats, 10 * bench.response_s()); });
  } else {
    level.notes.push_back(fmt::format("S-curve, ON, at {:g} lux: the threshold is beyond a factor of 7 in light", lux));
  }
  if (2 * off < kMaxContrast) {
    attempt("S-curve, OFF", [&] { level.off = s_curve(bench, off, -1, options.repeats); });
  } else {
    level.notes.push_back(
        fmt::format("S-curve, OFF, at {:g} lux: the threshold is beyond a factor of 7 in light", lux));
  }
  attempt("latency", [&] { measure_latency(bench, options.repeats, level); });
  if (std::isfinite(level.on.threshold))
    attempt("bandwidth", [&] { level.bandwidth_hz = bench.bandwidth(level.on).bandwidth_hz; });
  const NoiseRates noise = measure_noise(simulated_sensor(sensor, options.width, options.height, options.seed), lux,
                                         std::max(1.0, 10 * bench.response_s()), options.noise_s);
  level.noise_on_hz = noise.on_hz, level.noise_off_hz = noise.off_hz, level.alternating = noise.alternating;
  return level;
}

/// By bisection of the logarithm. Noise responds in trials with and without a change; only what is more than that
/// counts. Pixels that do not even see the pulse of a trial do not respond.
double find_cutoff(const EventCameraOptions& sensor, const CharacterisationOptions& options) {
  const auto responds = [&](double lux) {
    Bench bench(sensor, options, lux);
    try {
      const TrialCounts counts = bench.steps({1e-6, kDoubled}, 2);
      return counts.fraction(1) - counts.fraction(0) >= 0.5;
    } catch (const UserError&) {
      return false;
    }
  };
  double low = std::log10(kDarkest_lux), high = std::log10(kBrightest_lux);
  if (!responds(kBrightest_lux))
    throw UserError("fewer than half of the pixels respond to doubled light at 100,000 lux");
  if (responds(kDarkest_lux))
    throw UserError(fmt::format("pixels still respond to doubled light at {:g} lux", kDarkest_lux));
  while (high - low > 0.02) {
    const double middle = 0.5 * (low + high);
    (responds(std::pow(10, middle)) ? high : low) = middle;
  }
  return std::pow(10, high);
}

double find_refractory(const EventCameraOptions& sensor, const CharacterisationOptions& options) {
  constexpr double kContrast = 6;
  const double light = sensor.circuit ? 200 : 1, rate = 0.02 / response_time_s(sensor, light);
  const SensorUnderTest bench = simulated_sensor(sensor, options.width, options.height, options.seed);
  return measure_refractory(bench, light, kContrast, std::vector{0.5 * rate, rate, 2 * rate}, 0.1).period_s;
}

double peak_rate(const EventCameraOptions& sensor, const CharacterisationOptions& options) {
  constexpr double kHalfPeriod_s = 5e-3;
  const double dark = sensor.circuit ? 316 : 0.1, bright = 10 * dark;
  Light light(dark);
  for (int k = 0; k < 4; ++k) {
    light.step_to(bright);
    light.keep(kHalfPeriod_s);
    light.step_to(dark);
    light.keep(kHalfPeriod_s);
  }
  const SensorUnderTest whole = simulated_sensor(sensor, options.sensor_width, options.sensor_height, options.seed);
  EventStatistics statistics(SensorSize{whole.width, whole.height});
  const std::vector<Event> events = whole.record(light.points());
  if (events.empty()) return 0;
  statistics.add(events);
  return 1e3 * static_cast<double>(std::move(statistics).finish().rate.max_in_1_ms());
}

}  // namespace

double Characterisation::dynamic_range_db() const { return 20 * std::log10(kBrightest_lux / cutoff_lux); }

Characterisation characterise_sensor(const std::string& name, const EventCameraOptions& sensor,
                                     const CharacterisationOptions& options,
                                     const std::function<void(double)>& progress) {
  Characterisation result;
  result.name = name;
  result.in_lux = sensor.circuit.has_value();
  result.levels.resize(options.lux.size());

  // Each measurement has its own sensor, so that they may run at the same time.
  struct Measurement {
    const char* name;
    std::function<void()> run;
  };
  std::vector<Measurement> measurements;
  for (std::size_t i = 0; i < options.lux.size(); ++i)
    measurements.push_back({"light", [&, i] { result.levels[i] = measure_level(sensor, options, options.lux[i]); }});
  measurements.push_back({"cutoff", [&] { result.cutoff_lux = find_cutoff(sensor, options); }});
  measurements.push_back({"refractory period", [&] { result.refractory_s = find_refractory(sensor, options); }});
  measurements.push_back({"peak rate", [&] { result.peak_rate_hz = peak_rate(sensor, options); }});

  std::vector<std::string> notes(measurements.size());
  std::mutex progress_mutex;
  int done = 0;
  Workers(options.threads).for_each(static_cast<int>(measurements.size()), [&](int index) {
    const auto i = static_cast<std::size_t>(index);
    try {
      measurements[i].run();
    } catch (const UserError& error) {
      notes[i] = std::string(measurements[i].name) + ": " + error.what();
    }
    const std::lock_guard lock(progress_mutex);
    if (progress) progress(static_cast<double>(++done) / static_cast<double>(measurements.size()));
  });
  std::copy_if(notes.begin(), notes.end(), std::back_inserter(result.notes),
               [](const std::string& note) { return !note.empty(); });
  return result;
}

}  // namespace esim::inline characterise
