#include "esim/sensors/pixel_signal.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace esim {
namespace {

/// A segment of 1 ms, its input and two poles, from random numbers of very different sizes.
struct Case {
  double rate, start, slope, filtered1, filtered2;
  static constexpr double kDuration = 1e6;  // ns

  explicit Case(std::mt19937& random) {
    std::normal_distribution<double> normal;
    rate = std::exp(3 * normal(random)) / kDuration;
    start = normal(random);
    slope = normal(random) * 1e-6;
    filtered1 = start + normal(random);
    filtered2 = filtered1 + normal(random);
    if (random() % 4 == 0) slope = 0;
  }
  double moved() const { return -std::expm1(-rate * kDuration); }
  RelaxingSignal order1() const { return RelaxingSignal::first_order(rate, moved(), filtered1, start, slope); }
  RelaxingSignal order2() const {
    return RelaxingSignal::second_order(rate, moved(), filtered1, filtered2, start, slope);
  }
};

TEST(RelaxingSignal, SolvesTheDifferentialEquation) {
  std::mt19937 random(1);
  for (int i = 0; i < 200; ++i) {
    const Case c(random);
    const RelaxingSignal order1 = c.order1(), order2 = c.order2();
    EXPECT_NEAR(order1.value(0), c.filtered1, 1e-12 * (1 + std::fabs(c.slope / c.rate)));
    EXPECT_NEAR(order2.value(0), c.filtered2, 1e-12 * (1 + std::fabs(c.slope / c.rate)));
    // dF/dt = rate (input - F), by central differences.
    for (const double tau : {2e5, 7e5}) {
      const double h = std::min(1e3, 1e-3 / c.rate), input = c.start + c.slope * tau;
      const double tolerance = 1e-5 * c.rate * (1 + std::fabs(c.slope / c.rate));
      const auto derivative = [&](const RelaxingSignal& s) { return (s.value(tau + h) - s.value(tau - h)) / (2 * h); };
      EXPECT_NEAR(derivative(order1), c.rate * (input - order1.value(tau)), tolerance);
      EXPECT_NEAR(derivative(order2), c.rate * (order1.value(tau) - order2.value(tau)), tolerance);
    }
  }
}

/// The first time on a fine grid at which the signal is outside of the band.
Crossing search(const RelaxingSignal& signal, double low, double high, double from) {
  constexpr int kSteps = 20000;
  for (int i = 0; i <= kSteps; ++i) {
    const double tau = from + (Case::kDuration - from) * i / kSteps, value = signal.value(tau);
    if (value >= high || value <= low) return {tau, value >= high};
  }
  return {};
}

TEST(RelaxingSignal, FindsTheFirstCrossingThatAFineSearchFinds) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform;
  int found = 0, turned = 0;
  for (int i = 0; i < 1500; ++i) {
    const Case c(random);
    RelaxingSignal signal = i % 2 == 0 ? c.order1() : c.order2();
    signal.add(0.1, 3e-7 * uniform(random));  // a leak
    const double from = i % 3 == 0 ? Case::kDuration * uniform(random) : 0;
    signal.advance(from);
    const double now = signal.value(from);
    EXPECT_NEAR(signal.value(), now, 1e-12 * (1 + std::fabs(now)));
    const double high = now + 0.7 * uniform(random), low = now - 0.7 * uniform(random);

    const Crossing expected = search(signal, low, high, from);
    const Crossing crossing = signal.first_crossing(Case::kDuration, low, high);
    const double end = signal.value(Case::kDuration);
    turned += expected.tau != kNever && end > low && end < high ? 1 : 0;
    if (expected.tau == kNever) {
      // The search may miss a level that is only just touched.
      if (crossing.tau == kNever) continue;
      EXPECT_NEAR(signal.value(crossing.tau), crossing.on ? high : low, 1e-6);
      continue;
    }
    ++found;
    ASSERT_NE(crossing.tau, kNever) << i;
    EXPECT_LE(crossing.tau, expected.tau + 1) << i;
    EXPECT_GE(crossing.tau, expected.tau - (Case::kDuration - from) / 20000 - 1) << i;
    EXPECT_EQ(crossing.on, expected.on) << i;
    const double per_ns = std::fabs(signal.value(crossing.tau + 0.5) - signal.value(crossing.tau - 0.5));
    EXPECT_NEAR(signal.value(crossing.tau), crossing.on ? high : low, 1e-9 * (1 + std::fabs(now)) + 0.1 * per_ns) << i;
  }
  EXPECT_GT(found, 500);
  EXPECT_GT(turned, 20);  // crossings that the segment's ends do not show
}

TEST(RelaxingSignal, DoesManyAtOnceAsItDoesOne) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform;
  std::vector<RelaxingSignal> signals;
  std::vector<double> low, high, from;
  for (int i = 0; i < 4999; ++i) {
    const Case c(random);
    RelaxingSignal signal = i % 3 == 0 ? c.order2() : c.order1();
    signal.add(0.1, 3e-7 * uniform(random));
    if (i % 2 == 0) signal.advance(Case::kDuration * uniform(random));
    low.push_back(signal.value() - (i % 50 == 0 ? -0.01 : 0.7 * uniform(random)));
    high.push_back(signal.value() + 0.7 * uniform(random));
    from.push_back(Case::kDuration * uniform(random));
    signals.push_back(signal);
  }
  std::vector<Crossing> crossings(signals.size());
  RelaxingSignal::first_crossings(signals, Case::kDuration, low.data(), high.data(), crossings.data());
  for (std::size_t i = 0; i < signals.size(); ++i) {
    const Crossing expected = signals[i].first_crossing(Case::kDuration, low[i], high[i]);
    ASSERT_EQ(crossings[i].tau == kNever, expected.tau == kNever) << i;
    if (expected.tau == kNever) continue;
    EXPECT_NEAR(crossings[i].tau, expected.tau, 0.3) << i;
    EXPECT_EQ(crossings[i].on, expected.on) << i;
  }
  std::vector<RelaxingSignal> advanced = signals;
  RelaxingSignal::advance(advanced, from.data());
  for (std::size_t i = 0; i < signals.size(); ++i)
    EXPECT_NEAR(advanced[i].value(), signals[i].value(from[i]), 1e-11 * (1 + std::fabs(signals[i].value(from[i]))))
        << i;
}

TEST(LinearSignal, FindsItsCrossing) {
  LinearSignal signal{1.0, 2e-6};
  EXPECT_EQ(signal.first_crossing(1e6, 0.5, 3.1).tau, kNever);
  EXPECT_NEAR(signal.first_crossing(1e6, 0.5, 2.0).tau, 5e5, 1e-6);
  EXPECT_TRUE(signal.first_crossing(1e6, 0.5, 2.0).on);
  signal.slope = -2e-6;
  EXPECT_NEAR(signal.first_crossing(1e6, 0.5, 2.0).tau, 2.5e5, 1e-6);
  EXPECT_FALSE(signal.first_crossing(1e6, 0.5, 2.0).on);
  signal.advance(4e5);
  EXPECT_NEAR(signal.first_crossing(1e6, 0.5, 2.0).tau, 4e5, 1e-6);  // it has already left
}

}  // namespace
}  // namespace esim
