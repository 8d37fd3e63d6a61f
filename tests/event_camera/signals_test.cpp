#include "esim/event_camera/pixel/relaxing_signal.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "esim/event_camera/pixel/linear_signals.h"
#include "esim/event_camera/pixel/relaxing_signals.h"

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

/// The first time on a fine grid at which the signal is outside the bounds.
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
      // The search may miss a level that is barely touched.
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
  EXPECT_GT(turned, 20);  // crossings that are not visible at the segment's ends
}

/// A block of signals whose state is in floats, as in the camera.
template <int kPoles>
struct Block {
  ActivePixels active;
  RelaxingSignals signals;
  Comparators compare;

  explicit Block(std::mt19937& random, double duration = Case::kDuration) {
    std::uniform_real_distribution<double> uniform;
    active.count = compare.count = kBlock;
    compare.threshold_on = compare.threshold_off = 0.01;
    for (std::size_t i = 0; i < kBlock; ++i) {
      const Case c(random);
      active.start[i] = static_cast<float>(c.start);
      active.end[i] = static_cast<float>(c.start + c.slope * Case::kDuration);
      active.filtered1[i] = static_cast<float>(c.filtered1);
      active.filtered2[i] = static_cast<float>(c.filtered2);
      active.phase[i] = static_cast<float>(c.rate * Case::kDuration);
      active.moved[i] = static_cast<float>(-std::expm1(-active.phase[i]));
      compare.drift[i] = 0.3 / duration * uniform(random);
      compare.from[i] = i % 2 == 0 ? duration * uniform(random) : 0;
    }
    signals.take(active, 0, kPoles, duration);
    signals.advance(compare);
    for (std::size_t i = 0; i < kBlock; ++i) {
      compare.reference[i] = signals.value(i) + compare.drift[i] * compare.from[i];
      compare.on[i] = static_cast<float>(0.7 * uniform(random));
      compare.off[i] = static_cast<float>(i % 50 == 0 ? -0.02 : 0.7 * uniform(random));  // some are outside already
    }
  }
};

template <int kPoles>
void expect_the_same_as_one_by_one(double duration) {
  std::mt19937 random(3);
  int crossed = 0, quiet = 0;
  for (int round = 0; round < 30; ++round) {
    Block<kPoles> block(random, duration);
    Comparators& compare = block.compare;
    block.signals.find(compare);
    PerPixel<double> again{};
    block.signals.look_ahead(compare, again.data());
    for (std::size_t i = 0; i < kBlock; ++i) {
      const RelaxingSignal one = block.signals.signal(compare, i);
      EXPECT_NEAR(block.signals.value(i) + compare.drift[i] * compare.from[i], one.value(),
                  1e-9 * (1 + std::fabs(one.value())));
      EXPECT_NEAR(block.signals.end(i) + compare.drift[i] * duration, one.value(duration),
                  1e-5 * (1 + std::fabs(one.value(duration))));  // moved is a float
      const Crossing expected = one.first_crossing(duration, compare.lower(i), compare.upper(i));
      ASSERT_EQ(compare.polarity[i] == 0, expected.tau == kNever) << i;
      if (expected.tau == kNever) {
        quiet += again[i] == 0 ? 1 : 0;
        continue;
      }
      ++crossed;
      EXPECT_TRUE(again[i] != 0 || i % 50 == 0) << i;
      EXPECT_NEAR(compare.tau[i], expected.tau, 0.3) << i;
      EXPECT_EQ(compare.polarity[i] > 0, expected.on) << i;
    }
  }
  EXPECT_GT(crossed, 1000);
  EXPECT_GT(quiet, kPoles == 1 ? 500 : -1);  // looking ahead is useful
}

TEST(RelaxingSignals, AreTheSameAsOneByOne) {
  expect_the_same_as_one_by_one<1>(Case::kDuration);
  expect_the_same_as_one_by_one<2>(Case::kDuration);
}

TEST(RelaxingSignals, AreAsPreciseInLongSegments) {
  expect_the_same_as_one_by_one<1>(33e6);
  expect_the_same_as_one_by_one<1>(1e9);
}

TEST(RelaxingSignals, DoNotDependOnTheirNeighbours) {
  std::mt19937 random(4);
  Block<1> block(random), single(random);
  block.signals.find(block.compare);
  for (std::size_t i = 0; i < kBlock; ++i) {
    single.active.copy(0, 0);
    for (auto values : {&ActivePixels::start, &ActivePixels::end, &ActivePixels::filtered1, &ActivePixels::phase,
                        &ActivePixels::moved}) {
      (single.active.*values)[0] = (block.active.*values)[i];
    }
    single.compare.on[0] = block.compare.on[i], single.compare.off[0] = block.compare.off[i];
    single.compare.reference[0] = block.compare.reference[i], single.compare.drift[0] = block.compare.drift[i];
    single.compare.from[0] = block.compare.from[i];
    single.active.count = single.compare.count = 1;
    single.signals.take(single.active, 0, 1, Case::kDuration);
    single.signals.advance(single.compare);
    single.signals.find(single.compare);
    EXPECT_EQ(single.compare.polarity[0], block.compare.polarity[i]);
    if (block.compare.polarity[i] == 0) continue;
    EXPECT_EQ(single.compare.tau[0], block.compare.tau[i]) << i;
  }
}

TEST(LinearSignals, FindTheirCrossings) {
  LinearSignals signals;
  Comparators compare{};
  ActivePixels active{};
  const double ends[] = {3.0, 3.0, -1.0, -1.0, 1.0}, on[] = {3.1, 1.0, 1.0, 1.0, 1.0}, from[] = {0, 0, 0, 4e5, 0};
  active.count = compare.count = 5;
  for (std::size_t i = 0; i < 5; ++i) {
    active.start[i] = 1, active.end[i] = static_cast<float>(ends[i]);
    compare.reference[i] = 1, compare.on[i] = static_cast<float>(on[i]), compare.off[i] = 0.5F;
    compare.from[i] = from[i];
  }
  compare.drift[4] = 2e-6;
  signals.take(active, 0, 1e6);
  signals.advance(compare);
  signals.find(compare);
  EXPECT_EQ(compare.polarity[0], 0);
  EXPECT_EQ(compare.polarity[1], 1);
  EXPECT_NEAR(compare.tau[1], 5e5, 1e-6);
  EXPECT_EQ(compare.polarity[2], -1);
  EXPECT_NEAR(compare.tau[2], 2.5e5, 1e-6);
  EXPECT_EQ(compare.polarity[3], -1);
  EXPECT_NEAR(compare.tau[3], 4e5, 1e-6);  // it is already outside
  EXPECT_NEAR(signals.value(3), 0.2, 1e-12);
  EXPECT_EQ(compare.polarity[4], 1);  // only by the leak
  EXPECT_NEAR(compare.tau[4], 5e5, 1e-6);
}

}  // namespace
}  // namespace esim
