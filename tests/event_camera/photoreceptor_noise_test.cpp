// The lazily evaluated noise of the photoreceptor against its stationary statistics, and against exact short steps.
#include "esim/event_camera/circuit/photoreceptor_noise.h"

#include <gtest/gtest.h>

#include <random>

#include "esim/core/error.h"

namespace esim {
namespace {

constexpr double kMs = 1e6;  // ns

PhotoreceptorNoise make_noise(double t1_ms = 5, double t2_ms = 1.5, std::uint64_t seed = 1) {
  return {1.0, t2_ms * kMs, t1_ms * kMs, t1_ms * kMs, AddressedRandom(seed, Purpose::test)};
}

struct Ramp {
  double at_start = 0, per_ns = 0;  // at the start of the interval
  double value(double tau) const { return at_start + per_ns * tau; }
  double slope(double) const { return per_ns; }
  std::pair<double, double> range(double a, double b) const { return std::minmax(value(a), value(b)); }
};

struct TimedEvent {
  double t;  // ns
  int polarity;
  friend bool operator==(const TimedEvent&, const TimedEvent&) = default;
};

/// A pixel in constant light: comparators around a reference R, a leak, and a hold after each event.
struct Pixel {
  double theta_on = 1, theta_off = 1;  // in the units of x
  double leak_per_ns = 0, hold_ns = 0;
  double offset = 0;  // of R at the start
};

/// Its events, if it looks at its signal in windows of this length.
std::vector<TimedEvent> run(const PhotoreceptorNoise& noise, const Pixel& pixel, std::uint32_t index,
                            double duration_ns, double window_ns) {
  std::vector<TimedEvent> events;
  double start = 0, reference = pixel.offset, held_until = -1;
  const auto level_at = [&](double t) {
    const double signal = pixel.leak_per_ns * t, s = noise.deviation(0);
    return noise.level_for(0, std::min(reference + pixel.theta_on - signal, signal - reference + pixel.theta_off) / s);
  };
  PhotoreceptorNoise::StepDraws draws;
  auto interval = noise.first(index, 0, level_at(0), draws);
  reference += pixel.hold_ns > 0 ? interval.from.x : 0;
  for (std::int64_t window = 0; static_cast<double>(window) * window_ns < duration_ns; ++window) {
    const double until = std::min(static_cast<double>(window + 1) * window_ns, duration_ns);
    double now = static_cast<double>(window) * window_ns;
    while (now < until) {
      if (now >= start + interval.length) {
        start += interval.length;
        interval = noise.next(interval.to, index, interval.node + 1, 0, level_at(start), 0, draws);
        continue;
      }
      const double stop = std::min(until, start + interval.length);
      if (held_until >= 0) {
        if (held_until >= stop) {
          now = stop;
          continue;
        }
        reference = noise.at(interval, held_until - start).x + pixel.leak_per_ns * held_until;
        now = std::max(now, held_until);
        held_until = -1;
      }
      const Ramp ramp{pixel.leak_per_ns * start, pixel.leak_per_ns};
      PhotoreceptorNoise::Quiet quiet;
      const auto crossing = noise.first_crossing(interval, ramp, reference - pixel.theta_off,
                                                 reference + pixel.theta_on, now - start, stop - start, quiet);
      if (!crossing) {
        now = stop;
        continue;
      }
      now = start + crossing->tau;
      events.push_back({now, crossing->polarity});
      reference += crossing->polarity > 0 ? pixel.theta_on : -pixel.theta_off;
      if (pixel.hold_ns > 0) held_until = now + pixel.hold_ns;
    }
  }
  return events;
}

/// The same pixel with exact steps of h, drawn one after the other.
std::vector<TimedEvent> run_by_steps(const Pixel& pixel, double t1, double t2, double duration_ns, double h,
                                     std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  // Exact for y; x follows y linearly within a step, with an error of the order of (h / t2)^2.
  const double e1 = std::exp(-h / t1), e2 = std::exp(-h / t2), kick = std::sqrt(1 - e1 * e1);
  std::vector<TimedEvent> events;
  double y = normal(random), reference = pixel.offset, held_until = -1;
  const double common = t1 / (t1 + t2);
  double x = common * y + std::sqrt(common - common * common) * normal(random);
  if (pixel.hold_ns > 0) reference += x;
  for (double t = 0; t < duration_ns; t += h) {
    const double before = y;
    y = e1 * y + kick * normal(random);
    const double rise = (y - before) / h;
    x = e2 * x + (1 - e2) * before + rise * (h - t2 * (1 - e2));
    const double v = x + pixel.leak_per_ns * (t + h);
    if (held_until >= 0) {
      if (t + h < held_until) continue;
      reference = v, held_until = -1;
      continue;
    }
    const int polarity = v >= reference + pixel.theta_on ? 1 : v <= reference - pixel.theta_off ? -1 : 0;
    if (polarity == 0) continue;
    events.push_back({t + h, polarity});
    reference += polarity > 0 ? pixel.theta_on : -pixel.theta_off;
    if (pixel.hold_ns > 0) held_until = t + h + pixel.hold_ns;
  }
  return events;
}

TEST(PhotoreceptorNoise, HasTheVarianceAndTheMemoryOfTheCircuit) {
  for (const auto& [t1_ms, t2_ms] : {std::pair{5.0, 1.5}, {100.0, 1.5}, {0.15, 1.5}, {1.5, 1.5}}) {
    const PhotoreceptorNoise noise = make_noise(t1_ms, t2_ms);
    const double t1 = noise.t1_ns(0), t2 = noise.t2_ns(), s2 = t1 / (t1 + t2), lag = 0.2 * (t1 + t2);
    EXPECT_NEAR(noise.deviation(0), std::sqrt(s2), 1e-12);
    double xx = 0, yy = 0, xy = 0, lagged = 0;
    constexpr int kPixels = 40'000;
    for (std::uint32_t i = 0; i < kPixels; ++i) {
      PhotoreceptorNoise::StepDraws draws;
      const auto interval = noise.first(i, 0, static_cast<std::int32_t>(i % PhotoreceptorNoise::kSteps), draws);
      const double tau = (0.05 + 0.9 * (i % 97) / 97.0) * (interval.length - lag);
      const NoiseState a = noise.at(interval, tau), b = noise.at(interval, tau + lag);
      xx += a.x * a.x, yy += a.y * a.y, xy += a.x * a.y, lagged += a.x * b.x;
    }
    // Autocovariance of x: s2 (t1 exp(-u/t1) - t2 exp(-u/t2)) / (t1 - t2).
    const double expected = s2 * (t1 * std::exp(-lag / t1) - t2 * std::exp(-lag / t2)) / (t1 - t2);
    const double tolerance = 4 * std::sqrt(2.0 / kPixels);
    EXPECT_NEAR(yy / kPixels, 1.0, tolerance) << t1_ms;
    EXPECT_NEAR(xx / kPixels, s2, tolerance * s2) << t1_ms;
    EXPECT_NEAR(xy / kPixels, s2, tolerance) << t1_ms;
    EXPECT_NEAR(lagged / kPixels, expected, tolerance * s2) << t1_ms;
  }
}

TEST(PhotoreceptorNoise, StepsKeepTheVarianceAndTheMemoryOfTheCircuit) {
  for (const auto& [t1_ms, t2_ms] : {std::pair{5.0, 1.5}, {100.0, 1.5}, {0.15, 1.5}, {1.5, 1.5}}) {
    const PhotoreceptorNoise noise = make_noise(t1_ms, t2_ms);
    const double t1 = noise.t1_ns(0), t2 = noise.t2_ns(), s2 = t1 / (t1 + t2);
    const double h = noise.length(0, PhotoreceptorNoise::kSteps);
    double xx = 0, yy = 0, xy = 0, lagged = 0, within = 0;
    constexpr int kPixels = 40'000;
    for (std::uint32_t i = 0; i < kPixels; ++i) {
      PhotoreceptorNoise::StepDraws draws;
      auto interval = noise.first(i, 0, PhotoreceptorNoise::kSteps, draws);
      const double before = interval.from.x;
      for (std::uint32_t node = 1; node < 12; ++node)
        interval = noise.next(interval.to, i, node, 0, PhotoreceptorNoise::kSteps, 0, draws);
      const NoiseState& a = interval.to;
      xx += a.x * a.x, yy += a.y * a.y, xy += a.x * a.y, lagged += before * a.x;
      const NoiseState middle = noise.at(interval, (0.05 + 0.9 * (i % 97) / 97.0) * h);
      within += middle.x * middle.x;
    }
    const double lag = 12 * h, tolerance = 4 * std::sqrt(2.0 / kPixels);
    const double expected = s2 * (t1 * std::exp(-lag / t1) - t2 * std::exp(-lag / t2)) / (t1 - t2);
    EXPECT_NEAR(yy / kPixels, 1.0, tolerance) << t1_ms;
    EXPECT_NEAR(xx / kPixels, s2, tolerance * s2) << t1_ms;
    EXPECT_NEAR(within / kPixels, s2, tolerance * s2) << t1_ms;
    EXPECT_NEAR(xy / kPixels, s2, tolerance) << t1_ms;
    EXPECT_NEAR(lagged / kPixels, expected, tolerance * s2) << t1_ms;
  }
}

TEST(PhotoreceptorNoise, IsTheSameFunctionOfTimeHoweverItIsCut) {
  const PhotoreceptorNoise noise = make_noise();
  const double s = noise.deviation(0);
  for (const Pixel& pixel : {Pixel{3 * s, 3 * s}, Pixel{3 * s, 2.5 * s, 1e-10, 0}, Pixel{3 * s, 3 * s, 0, 1 * kMs}}) {
    std::size_t count = 0;
    for (std::uint32_t i = 0; i < 30; ++i) {
      const auto whole = run(noise, pixel, i, 4000 * kMs, 4000 * kMs);
      for (const double window_ms : {5.0, 1.0, 0.05}) {
        const auto cut = run(noise, pixel, i, 4000 * kMs, window_ms * kMs);
        ASSERT_EQ(cut.size(), whole.size());
        for (std::size_t k = 0; k < cut.size(); ++k) {
          EXPECT_EQ(cut[k].polarity, whole[k].polarity);
          EXPECT_NEAR(cut[k].t, whole[k].t, 0.1);  // ns
        }
      }
      count += whole.size();
    }
    EXPECT_GT(count, 100u);
  }
}

struct Statistics {
  double on_hz = 0, off_hz = 0, alternation = 0, error_hz = 0;
};

template <typename Run>
Statistics measure(int pixels, double duration_s, const Run& events_of) {
  Statistics result;
  double pairs = 0, alternating = 0;
  for (int i = 0; i < pixels; ++i) {
    const std::vector<TimedEvent> events = events_of(static_cast<std::uint32_t>(i));
    for (std::size_t k = 0; k < events.size(); ++k) {
      (events[k].polarity > 0 ? result.on_hz : result.off_hz) += 1 / (pixels * duration_s);
      if (k > 0) pairs += 1, alternating += events[k].polarity != events[k - 1].polarity;
    }
  }
  result.alternation = alternating / std::max(pairs, 1.0);
  // Events come in pairs and bursts: their number varies about twice as much as a Poisson number.
  result.error_hz = 2 * std::sqrt((result.on_hz + result.off_hz) / (pixels * duration_s));
  return result;
}

// Rates, the ratio of polarities and their alternation agree with exact steps of t2 / 50.
TEST(PhotoreceptorNoise, GivesTheEventsOfExactSteps) {
  const double s = make_noise().deviation(0);
  struct Case {
    Pixel pixel;
    const char* what;
  };
  for (const Case& test : {Case{{2.5 * s, 2.5 * s}, "z 2.5"}, Case{{3 * s, 3 * s}, "z 3"},
                           Case{{4 * s, 4 * s, 0.1 * 4 * s * 1e-9}, "leak of 0.1 Hz"},
                           Case{{3 * s, 3 * s, 0, 1 * kMs}, "hold of 1 ms"}, Case{{3 * s, 2.3 * s}, "asymmetric"}}) {
    const PhotoreceptorNoise noise = make_noise();
    const Statistics lazy =
        measure(600, 4, [&](std::uint32_t i) { return run(noise, test.pixel, i, 4000 * kMs, 1 * kMs); });
    std::mt19937_64 random(7);
    const Statistics exact = measure(200, 4, [&](std::uint32_t) {
      return run_by_steps(test.pixel, 5 * kMs, 1.5 * kMs, 4000 * kMs, 0.03 * kMs, random);
    });
    const double tolerance = 3 * std::hypot(lazy.error_hz, exact.error_hz);
    EXPECT_NEAR(lazy.on_hz, exact.on_hz, tolerance) << test.what;
    EXPECT_NEAR(lazy.off_hz, exact.off_hz, tolerance) << test.what;
    EXPECT_NEAR(lazy.alternation, exact.alternation, 0.06) << test.what;
    EXPECT_LT(tolerance, 0.35 * (exact.on_hz + exact.off_hz)) << test.what;
  }
}

TEST(PhotoreceptorNoise, RefusesTimeConstantsThatCannotBe) {
  const AddressedRandom random(1, Purpose::test);
  EXPECT_THROW(PhotoreceptorNoise(0, 1, 1, 1, random), UserError);
  EXPECT_THROW(PhotoreceptorNoise(1, 0, 1, 1, random), UserError);
  EXPECT_THROW(PhotoreceptorNoise(1, 1, 0, 1, random), UserError);
  EXPECT_THROW(PhotoreceptorNoise(1, 1, 2, 1, random), UserError);
}

}  // namespace
}  // namespace esim
