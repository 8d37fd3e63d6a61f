#include "esim/fit/background_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "esim/fit/jackknife.h"
#include "esim/stats/numerics/median.h"
#include "esim/stats/numerics/minimise.h"

namespace esim::inline fit {
namespace {

constexpr double kFewestOn = 200;
constexpr double kPeriodic = 0.5;       // coefficient of variation of a pixel's intervals; 1: Poisson
constexpr double kWithoutNoise = 0.02;  // OFF events as a fraction of the ON events
// A hot pixel: standard deviations above the median, and times the median.
constexpr double kFarAbove = 5, kTimesAbove = 4;
constexpr TimeNs kStretch = 500 * kNsPerMs;
constexpr double kFewestStretches = 20;
const double kLn10 = std::numbers::ln10;

const char* const kConstantLight = "events in constant light";

/// A pixel of which log10 of the rate is known, with the variance of its error.
struct KnownRate {
  double log_rate = 0, variance = 0;
};

/// The distribution of log10(rate), a normal one.
struct LogNormal {
  double centre = 0, decades = 0;

  double below(double rate) const {
    return 0.5 * std::erfc((centre - std::log10(rate)) / (decades * std::numbers::sqrt2));
  }
};

/// Minus the log-likelihood of `known` pixels and of `silent` ones, which have at most one event in `duration_s`. With
/// a uniform phase, a pixel that expects a events has at most one with the probability min(1, max(0, 2 - a)).
double surprisal(const LogNormal& d, const std::vector<KnownRate>& known, std::size_t silent, double duration_s) {
  double sum = 0;
  for (const KnownRate& pixel : known) {
    const double variance = d.decades * d.decades + pixel.variance, gap = pixel.log_rate - d.centre;
    sum += 0.5 * (gap * gap / variance + std::log(variance));
  }
  if (silent == 0) return sum;
  constexpr int kSteps = 64;
  double probability = d.below(1 / duration_s);
  for (int i = 0; i < kSteps; ++i) {
    const double from = 1 + static_cast<double>(i) / kSteps, to = from + 1.0 / kSteps;
    probability += (2 - 0.5 * (from + to)) * (d.below(to / duration_s) - d.below(from / duration_s));
  }
  return sum - static_cast<double>(silent) * std::log(std::max(probability, 1e-300));
}

/// With a normal error.
Estimate with_error(const char* name, const char* unit, double value, double error) {
  const double reach = kNormalQuantile * error;
  return Estimate::found(name, unit, value, std::max(0.0, value - reach), value + reach, kConstantLight);
}

/// 10^value, with an error of the value; `quantile` of its distribution.
Estimate of_log10(const char* name, const char* unit, double value, double error, double quantile) {
  return Estimate::found(name, unit, std::pow(10, value), std::pow(10, value - quantile * error),
                         std::pow(10, value + quantile * error), kConstantLight);
}

}  // namespace

double hot_pixel_limit(std::vector<double> events) {
  std::sort(events.begin(), events.end());
  const auto quantile = [&](double part) {
    return events[static_cast<std::size_t>(part * static_cast<double>(events.size() - 1))];
  };
  // Counts are at least as uncertain as one event, and spread by noise like those of a Poisson process.
  const double centre = std::max(1.0, quantile(0.5));
  const double decades =
      std::max({std::log10(std::max(1.0, quantile(0.84)) / centre), 1 / (kLn10 * std::sqrt(centre)), 0.02});
  return centre * std::max(kTimesAbove, std::pow(10, kFarAbove * decades));
}

struct BackgroundFit::Kept {
  struct One {
    const Pixel* pixel;
    std::size_t area;
  };
  std::vector<One> pixels;
  double variation = 1;  // coefficient of variation of the intervals between ON events
  double intervals = 0;  // how many determine it
  bool regular = true;   // every pixel has a rate
};

void BackgroundFit::add(EventSpan events) {
  for (const Event& event : events) {
    if (!start_) start_ = event.t;
    Pixel& pixel = pixels_(event.x, event.y);
    const std::size_t half = static_cast<std::size_t>((event.t - *start_) / kStretch) % 2;
    if (event.polarity < 0) {
      ++pixel.off[half];
      continue;
    }
    if (pixel.count_on() == 0) {
      pixel.first = event.t;
    } else {
      const double interval_s = to_seconds(event.t - pixel.last);
      pixel.squares += interval_s * interval_s;
    }
    ++pixel.on[half];
    pixel.last = event.t;
  }
}

BackgroundFit::Kept BackgroundFit::separate_hot_pixels(double duration_s, Result& result) const {
  const AreaGrid areas(pixels_.width(), pixels_.height());
  std::vector<double> counts;
  for (const Pixel& pixel : pixels_.pixels()) counts.push_back(pixel.count_on() + pixel.count_off());
  const double limit = hot_pixel_limit(counts);
  Kept kept;
  std::vector<double> hot;
  double squares = 0;
  for (int y = 0; y < pixels_.height(); ++y) {
    for (int x = 0; x < pixels_.width(); ++x) {
      const Pixel& pixel = pixels_(x, y);
      const double events = pixel.count_on() + pixel.count_off();
      if (events > limit) {
        hot.push_back(std::log10(events / duration_s));
        continue;
      }
      kept.pixels.push_back({&pixel, areas.of(x, y)});
      const double intervals = pixel.count_on() - 1;
      if (intervals >= 1 && pixel.last == pixel.first) kept.regular = false;  // time stamps are wrong
      if (intervals < 2 || pixel.last == pixel.first) continue;
      const double mean = to_seconds(pixel.last - pixel.first) / intervals;
      squares += (pixel.squares - intervals * mean * mean) / (mean * mean);
      kept.intervals += intervals - 1;
    }
  }
  if (kept.intervals > 0) kept.variation = std::sqrt(std::max(0.0, squares / kept.intervals));
  result.hot_pixels = fraction_estimate("hot_pixels", hot.size(), pixels_.size(), kConstantLight);
  constexpr std::size_t kFewestHot = 5;
  if (hot.size() < kFewestHot) {
    const std::string why =
        fmt::format("the sensor has {} hot pixels; at least {} are necessary", hot.size(), kFewestHot);
    result.hot_rate = Estimate::unknown("hot_pixel_rate_hz", "Hz", why);
    result.hot_decades = Estimate::unknown("circuit.hot_mismatch_decades", "", why);
    return kept;
  }
  const auto n = static_cast<double>(hot.size());
  double mean = 0, variance = 0;
  for (const double value : hot) mean += value / n;
  for (const double value : hot) variance += (value - mean) * (value - mean) / (n - 1);
  const double error = std::sqrt(variance / n), t = student_quantile(n - 1);
  result.hot_rate = of_log10("hot_pixel_rate_hz", "Hz", mean, error, t);
  result.hot_decades =
      with_error("circuit.hot_mismatch_decades", "", std::sqrt(variance), std::sqrt(variance / (2 * (n - 1))));
  return kept;
}

/// Leak without noise: each pixel fires at its own regular interval.
void BackgroundFit::fit_periodic(const Kept& kept, double duration_s, Result& result) const {
  std::vector<KnownRate> known;
  std::size_t silent = 0;
  for (const auto& [pixel, area] : kept.pixels) {
    const double intervals = pixel->count_on() - 1;
    if (intervals < 1) {
      ++silent;
      continue;
    }
    known.push_back({std::log10(intervals / to_seconds(pixel->last - pixel->first)),
                     kept.variation * kept.variation / (intervals * kLn10 * kLn10)});
  }
  std::vector<double> logs(silent, -std::numeric_limits<double>::infinity());
  for (const KnownRate& pixel : known) logs.push_back(pixel.log_rate);
  const double start = std::max(median(logs), std::log10(0.3 / duration_s));
  const auto value = [&](const std::vector<double>& p) {
    return surprisal({p[0], std::max(1e-4, std::abs(p[1]))}, known, silent, duration_s);
  };
  const std::vector<double> best = minimise(value, {start, 0.15}, {0.05, 0.05});
  const double centre = best[0], decades = std::abs(best[1]);
  // The inverse of the matrix of second derivatives.
  const double step = std::max(1e-3 * decades, 1e-5);
  const auto at = [&](double i, double j) { return value({centre + i * step, decades + j * step}); };
  const double middle = at(0, 0), cc = (at(1, 0) - 2 * middle + at(-1, 0)) / (step * step),
               dd = (at(0, 1) - 2 * middle + at(0, -1)) / (step * step),
               cd = (at(1, 1) - at(1, -1) - at(-1, 1) + at(-1, -1)) / (4 * step * step);
  const double determinant = cc * dd - cd * cd;
  if (!(determinant > 0 && cc > 0)) {
    const std::string why = fmt::format(
        "{} of {} pixels have fewer than two ON events; a longer recording is necessary", silent, kept.pixels.size());
    result.leak_rate = Estimate::unknown("leak_rate_hz", "Hz", why);
    result.leak_decades = Estimate::unknown("leak_mismatch_decades", "", why);
    return;
  }
  result.leak_rate = of_log10("leak_rate_hz", "Hz", centre, std::sqrt(dd / determinant), kNormalQuantile);
  result.leak_decades = with_error("leak_mismatch_decades", "", decades, std::sqrt(cc / determinant));
  if (kept.intervals > 0) {
    result.leak_jitter = with_error("leak_jitter", "", kept.variation, kept.variation / std::sqrt(2 * kept.intervals));
  }
  result.leak.title = "Leak rates of the pixels", result.leak.axis = "log10(rate / Hz)";
  for (const KnownRate& pixel : known) result.leak.values.push_back(pixel.log_rate);
  result.leak.density = normal_density(centre, std::max(decades, 1e-3));
}

/// Leak among noise: the events of each polarity balance.
void BackgroundFit::fit_moments(const Kept& kept, double duration_s, double ratio, Result& result) const {
  const AreaGrid areas(pixels_.width(), pixels_.height());
  std::vector<bool> used(areas.areas());
  for (const auto& one : kept.pixels) used[one.area] = true;
  const auto evaluate = [&](std::optional<std::size_t> without) {
    double n = 0, a = 0, b = 0, ab = 0;
    for (const auto& [pixel, area] : kept.pixels) {
      if (area == without) continue;
      const double first = pixel->on[0] - ratio * pixel->off[0], second = pixel->on[1] - ratio * pixel->off[1];
      n += 1, a += first, b += second, ab += first * second;
    }
    const double mean = (a + b) / n, covariance = ab / n - a / n * (b / n);
    const double spread = std::log(std::max(1.0, 1 + covariance / (a / n * (b / n)))) / (kLn10 * kLn10);  // decades^2
    return std::vector<double>{mean * std::exp(-0.5 * spread * kLn10 * kLn10) / duration_s, spread};
  };
  const auto found = jackknife(used, evaluate);
  const std::string why = "the sensor is too small: fewer than 10 of its 8 x 8 areas have pixels";
  if (!found) {
    result.leak_rate = Estimate::unknown("leak_rate_hz", "Hz", why);
    result.leak_decades = Estimate::unknown("leak_mismatch_decades", "", why);
    return;
  }
  const Jackknifed &rate = (*found)[0], &spread = (*found)[1];
  result.leak_rate = Estimate::found("leak_rate_hz", "Hz", std::max(0.0, rate.value), std::max(0.0, rate.low()),
                                     std::max(0.0, rate.high()), kConstantLight);
  const double stretches = duration_s / to_seconds(kStretch);
  if (rate.low() <= 0 || stretches < kFewestStretches) {
    result.leak_decades = Estimate::unknown(
        "leak_mismatch_decades", "",
        rate.low() <= 0 ? "the leak cannot be told from the noise" : "noise hides it in recordings shorter than 10 s");
    return;
  }
  result.leak_decades =
      Estimate::found("leak_mismatch_decades", "", std::sqrt(spread.value), std::sqrt(std::max(0.0, spread.low())),
                      std::sqrt(spread.high()), kConstantLight);
}

BackgroundFit::Result BackgroundFit::finish(double duration_s, double ratio) const {
  Result result;
  result.leak_jitter = Estimate::unknown("leak_jitter", "", "no pixel has regular leak events");
  const Kept kept = separate_hot_pixels(duration_s, result);
  double on = 0, off = 0, off_squares = 0;
  for (const auto& [pixel, area] : kept.pixels)
    on += pixel->count_on(), off += pixel->count_off(), off_squares += pixel->count_off() * pixel->count_off();
  const auto n = static_cast<double>(kept.pixels.size());
  result.on_hz = on / (n * duration_s), result.off_hz = off / (n * duration_s);

  constexpr double kNoneSeen = 3.7;  // mean of a Poisson variable that is 0 with a probability of 2.5 %
  const double off_error = std::sqrt(std::max(off, off_squares - off * off / n)) / (n * duration_s);
  result.noise = with_error("shot_noise_hz", "Hz", 2 * result.off_hz, 2 * off_error);
  if (off == 0) result.noise.high = 2 * kNoneSeen / (n * duration_s);

  if (on < kFewestOn) {
    const std::string why =
        fmt::format("the recording has only {:.0f} ON events of pixels that are not hot; at least {:.0f} are necessary",
                    on, kFewestOn);
    result.leak_rate = Estimate::unknown("leak_rate_hz", "Hz", why);
    result.leak_decades = Estimate::unknown("leak_mismatch_decades", "", why);
  } else if (kept.regular && off < kWithoutNoise * on && kept.variation < kPeriodic) {
    fit_periodic(kept, duration_s, result);
  } else {
    fit_moments(kept, duration_s, ratio, result);
  }
  return result;
}

}  // namespace esim::inline fit
