// A pixel by its circuit against a simulation of the same equations in short steps.
#include "esim/event_camera/circuit/circuit_pixel.h"

#include <gtest/gtest.h>

#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "support/sanitizers.h"

namespace esim {
namespace {

constexpr double kMs = 1e6;  // ns

struct TimedEvent {
  double t;  // ns
  int polarity;
};

using Light = std::function<double(double)>;  // L by time in ns

struct PixelSetup {
  CircuitPoles poles{5 * kMs, 1.5 * kMs};
  double variance = 0.0016;  // sigma .04 in the dark
  CircuitParameters pixel{0.12F, 0.12F, 1, 0};
  float leak = 0;  // 1/s
};

Circuit circuit_of(const PixelSetup& setup, std::uint64_t seed) {
  return {setup.poles,
          PhotoreceptorNoise(setup.variance, setup.poles.t2_ns, setup.poles.t1_unit_ns * std::exp(-12.0),
                             setup.poles.t1_unit_ns * std::exp(7.0), AddressedRandom(seed, Purpose::test))};
}

/// Events of a pixel whose light is sampled every dt, and linear in L between samples.
std::vector<TimedEvent> run(const PixelSetup& setup, const Circuit& circuit, std::uint32_t index, const Light& light,
                            double duration, double dt) {
  const bool high_pass = setup.poles.high_pass_per_ns > 0;
  CircuitState front{0, light(0), high_pass ? light(0) : 0.0};
  const double leak = 1e-9 * static_cast<double>(setup.leak);
  CircuitPixelState state;
  KnownPath known;
  CircuitPixel pixel(circuit, index, setup.pixel, state, known);
  pixel.open(light(0), high_pass ? 0.0 : front.v, {0, leak}, 0, 0.5);
  std::vector<TimedEvent> events;
  CircuitBounds bounds{1, -1, -1};
  for (std::int64_t i = 0; static_cast<double>(i) * dt < duration; ++i) {
    const double start = static_cast<double>(i) * dt;
    const LightRamp ramp{light(start), (light(start + dt) - light(start)) / dt};
    for (double done = 0, h = 0; done < 0.999999 * dt; done += h) {
      const LightRamp part{ramp.light + ramp.rate * done, ramp.rate};
      h = step_length(setup.poles, front, part, dt - done);
      const double from = start + done;
      const CircuitPiece piece = advance(setup.poles, front, part, h);
      const auto [low, high] = piece.range(0, h);
      const bool quiet = low + leak * from - state.reference > bounds.low &&
                         high + leak * (from + h) - state.reference < bounds.high && from + h < bounds.until &&
                         std::abs(part.light + part.rate * h - static_cast<double>(state.node_light)) < kLightReach;
      if (quiet) continue;
      pixel.set(piece, part, {leak * from, leak}, from);
      bounds = pixel.run([&](double t, int polarity) { events.push_back({t, polarity}); });
    }
  }
  return events;
}

/// The same from the equations, in steps of h.
std::vector<TimedEvent> run_by_steps(const PixelSetup& setup, const Light& light, double duration, double h,
                                     std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const double t2 = setup.poles.t2_ns, gain = static_cast<double>(setup.pixel.noise);
  const double e2 = std::exp(-h / t2);
  double t1 = setup.poles.t1_unit_ns * std::exp(-light(0));
  double ny = normal(random);
  const double common = t1 / (t1 + t2);
  double nx = common * ny + std::sqrt(common - common * common) * normal(random);
  const double sigma = gain * std::sqrt(setup.variance);
  const double k3 = setup.poles.high_pass_per_ns;
  double y = light(0), v = y, w = k3 > 0 ? v : 0.0, reference = v - w + sigma * nx, held_until = -1;
  std::vector<TimedEvent> events;
  for (double t = 0; t < duration; t += h) {
    t1 = setup.poles.t1_unit_ns * std::exp(-light(t + 0.5 * h));
    const double e1 = std::exp(-h / t1), before = ny;
    ny = e1 * ny + std::sqrt(1 - e1 * e1) * normal(random);
    nx = e2 * nx + (1 - e2) * before + (ny - before) / h * (h - t2 * (1 - e2));
    // Heun's method for the signal.
    const auto rate = [&](double at, double y_) {
      return (std::exp(light(at)) - std::exp(y_)) / setup.poles.t1_unit_ns;
    };
    const double k1 = rate(t, y), k2 = rate(t + h, y + h * k1), y1 = y + 0.5 * h * (k1 + k2);
    const double w1 = (y - v) / t2, w2 = (y1 - (v + h * w1)) / t2;
    const double v1 = v + 0.5 * h * (w1 + w2);
    w += (0.5 * (v + v1) - w) * -std::expm1(-k3 * h);
    v = v1, y = y1;
    const double s = v - w + sigma * nx + 1e-9 * static_cast<double>(setup.leak) * (t + h);
    if (held_until >= 0) {
      if (t + h < held_until) continue;
      reference = s, held_until = -1;
      continue;
    }
    const int polarity = s >= reference + static_cast<double>(setup.pixel.on)    ? 1
                         : s <= reference - static_cast<double>(setup.pixel.off) ? -1
                                                                                 : 0;
    if (polarity == 0) continue;
    events.push_back({t + h, polarity});
    reference += polarity > 0 ? setup.pixel.on : -setup.pixel.off;
    if (setup.pixel.refractory > 0) held_until = t + h + static_cast<double>(setup.pixel.refractory);
  }
  return events;
}

struct Counts {
  double on = 0, off = 0, alternating = 0, pairs = 0;
  std::vector<double> intervals;

  void add(const std::vector<TimedEvent>& events) {
    for (std::size_t i = 0; i < events.size(); ++i) {
      (events[i].polarity > 0 ? on : off) += 1;
      if (i == 0) continue;
      pairs += 1;
      alternating += events[i].polarity != events[i - 1].polarity ? 1 : 0;
      intervals.push_back(events[i].t - events[i - 1].t);
    }
  }
};

double kolmogorov(std::vector<double> a, std::vector<double> b) {
  std::sort(a.begin(), a.end());
  std::sort(b.begin(), b.end());
  double worst = 0;
  std::size_t j = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    while (j < b.size() && b[j] <= a[i]) ++j;
    worst = std::max(worst, std::abs(static_cast<double>(i + 1) / static_cast<double>(a.size()) -
                                     static_cast<double>(j) / static_cast<double>(b.size())));
  }
  return worst;
}

/// Compares rates, alternation and intervals. The limits follow from the number of events, which come in clusters:
/// their rates may differ by 5 standard errors of twice as many independent events, and by 3 % in any case.
void compare(const PixelSetup& setup, const Light& light, int pixels, double duration, double h) {
  if (test::kSanitized) GTEST_SKIP() << "takes minutes under sanitizers, where CircuitCamera runs the same code";
  const Circuit circuit = circuit_of(setup, 3);
  std::mt19937_64 random(5);
  Counts fast, slow;
  for (int i = 0; i < pixels; ++i) {
    fast.add(run(setup, circuit, static_cast<std::uint32_t>(i), light, duration, 1e6));
    slow.add(run_by_steps(setup, light, duration, h, random));
  }
  for (const auto& [a, b] : {std::pair{fast.on, slow.on}, {fast.off, slow.off}})
    EXPECT_NEAR(a / b, 1, 0.03 + 5 * std::sqrt(4 / b)) << a << " " << b;
  EXPECT_NEAR(fast.alternating / fast.pairs, slow.alternating / slow.pairs, 0.01);
  const double limit = 1.63 * std::sqrt(1.0 / static_cast<double>(fast.intervals.size()) +
                                        1.0 / static_cast<double>(slow.intervals.size()));  // 1 % level
  EXPECT_LT(kolmogorov(fast.intervals, slow.intervals), limit);
}

const Light kSine = [](double t) { return 1.0 + 1.2 * std::sin(2 * std::numbers::pi * 2e-9 * t); };

TEST(CircuitPixel, FiresInTheDarkAsItsEquationsDo) {
  const Light dark = [](double) { return 0.0; };
  PixelSetup setup;
  setup.pixel.refractory = 1e6F;
  compare(setup, dark, 60, 30e9, 40e3);
  setup.leak = 0.02F;
  compare(setup, dark, 60, 30e9, 40e3);
}

TEST(CircuitPixel, FiresInGreyLightAsItsEquationsDo) {
  PixelSetup setup;
  setup.pixel = {0.075F, 0.075F, 1, 1e6F};
  compare(
      setup, [](double) { return std::log(5.0); }, 20, 30e9, 15e3);
}

TEST(CircuitPixel, FollowsMovingLightAsItsEquationsDo) {
  PixelSetup setup;
  setup.pixel = {0.12F, 0.16F, 1, 0};
  compare(setup, kSine, 10, 30e9, 15e3);
  setup.pixel.refractory = 2e6F;
  compare(setup, kSine, 10, 30e9, 15e3);
  setup.pixel.noise = 0.5F;
  compare(
      setup, [](double t) { return 4 + kSine(t); }, 4, 10e9, 0.5e3);
}

TEST(CircuitPixel, ForgetsSlowChangesWithAHighPassAsItsEquationsDo) {
  PixelSetup setup;
  setup.pixel = {0.12F, 0.16F, 1, 1e6F};
  setup.poles.high_pass_per_ns = 2e-9 * std::numbers::pi * 5;  // above the 2 Hz of the light
  compare(setup, kSine, 10, 30e9, 15e3);
}

}  // namespace
}  // namespace esim
