#include "esim/light/modulation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "esim/core/error.h"
#include "support/errors.h"

namespace esim {
namespace {

constexpr TimeNs kNever = std::numeric_limits<TimeNs>::max();

std::vector<TimeNs> nodes_between(const Modulation& modulation, TimeNs t0, TimeNs t1) {
  std::vector<TimeNs> nodes = {t0};
  while (nodes.back() < t1) {
    const TimeNs next = std::min(t1, modulation.next_node(nodes.back()));
    EXPECT_GT(next, nodes.back());
    if (next <= nodes.back()) break;
    nodes.push_back(next);
  }
  return nodes;
}

const FlickerOptions kMains{.frequency_hz = 100, .depth = 0.5, .shape = FlickerShape::mains};

TEST(Modulation, HasTheShapesOfItsDefinition) {
  const double pi = std::numbers::pi;
  const Modulation mains(kMains, 0, {});
  const double mains_mean = 0.5 + 0.5 * 2 / pi;
  EXPECT_NEAR(mains.at(0), 0.5 / mains_mean, 1e-12);
  EXPECT_NEAR(mains.at(5 * kNsPerMs), 1 / mains_mean, 1e-12);
  EXPECT_NEAR(mains.at(13 * kNsPerMs), (0.5 + 0.5 * std::sin(0.3 * pi)) / mains_mean, 1e-9);
  const Modulation sine({50, 0.8, FlickerShape::sine, 0.5, 0.25}, 0, {});
  EXPECT_NEAR(sine.at(0), 1, 1e-12);
  EXPECT_NEAR(sine.at(5 * kNsPerMs), 1 / 0.6, 1e-12);
  EXPECT_NEAR(sine.at(15 * kNsPerMs), 0.2 / 0.6, 1e-12);
  const Modulation pwm({1000, 1, FlickerShape::pwm, 0.25, 0}, 0, {});
  EXPECT_EQ(pwm.at(0), 4);
  EXPECT_EQ(pwm.at(249'999), 4);
  EXPECT_EQ(pwm.at(250'000), 0);
  EXPECT_EQ(pwm.at(999'999), 0);
  EXPECT_EQ(pwm.at(1'000'000), 4);
}

TEST(Modulation, KeepsTheMeanLight) {
  for (const FlickerShape shape : {FlickerShape::mains, FlickerShape::sine, FlickerShape::pwm}) {
    for (const double depth : {0.0, 0.3, 1.0}) {
      const Modulation modulation({100, depth, shape, 0.3, 0.1}, 0, {});
      double sum = 0;
      for (TimeNs t = 0; t < 10 * kNsPerMs; t += 1000) sum += modulation.at(t + 500);
      EXPECT_NEAR(sum / 10'000, 1, 1e-6) << static_cast<int>(shape) << ' ' << depth;
    }
  }
}

TEST(Modulation, HasTheIntegralsOfItsValues) {
  for (const FlickerShape shape : {FlickerShape::mains, FlickerShape::sine, FlickerShape::pwm}) {
    const Modulation modulation({100, 0.9, shape, 0.3, 0.15}, 0, {});
    for (const auto& [t0, t1] : {std::pair<TimeNs, TimeNs>(0, 1'000'000),
                                 {3'000'000, 31'400'000},
                                 {12'000, 12'000},
                                 {9'000'000, 9'000'001},
                                 {0, 10'000'000}}) {
      double m = 0, tm = 0;
      const int steps = 200'000;
      const double step_ns = static_cast<double>(t1 - t0) / steps, step = step_ns * 1e-9;
      for (int i = 0; i < steps; ++i) {
        const double value = modulation.at(t0 + static_cast<TimeNs>((i + 0.5) * step_ns));
        m += value * step;
        tm += value * (i + 0.5) * step * step;
      }
      const Modulation::Integrals integrals = modulation.integrals(t0, t1);
      const double duration = to_seconds(t1 - t0);
      EXPECT_NEAR(integrals.m, m, 1e-4 * duration + 1e-17) << static_cast<int>(shape) << ' ' << t0;
      EXPECT_NEAR(integrals.tm, tm, 1e-4 * duration * duration + 1e-17) << static_cast<int>(shape) << ' ' << t0;
    }
  }
}

struct Distance {
  double brightness = 0, late_ns = 0;  ///< the largest; of L, and of the times at which L has a value
};

/// The distance of L = ln(E m + dark) from straight lines between nodes, at eight times in each interval.
Distance distance_from_lines(const Modulation& modulation, double e, double dark, TimeNs duration) {
  const std::vector<TimeNs> nodes = nodes_between(modulation, 0, duration);
  const auto L = [&](TimeNs t) { return std::log(e * modulation.at(t) + dark); };
  Distance largest;
  for (std::size_t i = 1; i < nodes.size(); ++i) {
    const TimeNs a = nodes[i - 1], b = nodes[i];
    for (int k = 1; k < 8; ++k) {
      const TimeNs t = a + (b - a) * k / 8;
      const double s = static_cast<double>(t - a) / static_cast<double>(b - a);
      const double distance = std::abs(L(t) - ((1 - s) * L(a) + s * L(b)));
      largest.brightness = std::max(largest.brightness, distance);
      if (b - a < 100)
        largest.late_ns = std::max(largest.late_ns, distance / std::abs(L(b) - L(a)) * static_cast<double>(b - a));
    }
  }
  return largest;
}

TEST(Modulation, StaysOnLinesBetweenNodesForPixelsOfAnyIrradiance) {
  for (const FlickerShape shape : {FlickerShape::mains, FlickerShape::sine}) {
    for (const double depth : {0.01, 0.5, 0.999, 1.0}) {
      for (const double tolerance : {1e-5, 5e-4, 1e-2}) {
        const double dark = 1e-3;
        // A slow light, since nodes are rounded to nanoseconds (see the next test).
        const Modulation modulation({0.1, depth, shape, 0.5, 0.37}, 0, {tolerance, dark});
        double largest = 0;
        for (const double e : {1e-5, 0.01, 1.0, 100.0})
          largest = std::max(largest, distance_from_lines(modulation, e, dark, 10 * kNsPerSecond).brightness);
        EXPECT_LT(largest, 1.02 * tolerance) << static_cast<int>(shape) << ' ' << depth;
        if (depth > 0.1) {
          EXPECT_GT(largest, 0.5 * tolerance) << "more nodes than needed";
        }
      }
    }
  }
}

TEST(Modulation, ExceedsTheToleranceByRoundingOnlyInBrightPixelsNearADarkCusp) {
  const double tolerance = 1e-4, dark = 1e-3;
  for (const double depth : {0.5, 0.97, 1.0}) {
    const Modulation mains({100, depth, FlickerShape::mains, 0.5, 0.37}, 0, {tolerance, dark});
    const Modulation sine({100, depth, FlickerShape::sine, 0.5, 0.37}, 0, {tolerance, dark});
    for (const double e : {0.01, 1.0, 10.0, 100.0}) {
      EXPECT_LT(distance_from_lines(sine, e, dark, 10 * kNsPerMs).brightness, 1.02 * tolerance) << depth << ' ' << e;
      const double distance = distance_from_lines(mains, e, dark, 10 * kNsPerMs).brightness;
      EXPECT_LT(distance, (depth == 1 && e == 100 ? 3 : 1.02) * tolerance) << depth << ' ' << e;
    }
  }
  // In these intervals of nanoseconds, L is so steep that events are late or early by less than half a nanosecond.
  for (const double frequency : {100.0, 1000.0}) {
    const Modulation mains({frequency, 1, FlickerShape::mains, 0.5, 0.37}, 0, {tolerance, dark});
    const Distance distance = distance_from_lines(mains, 100, dark, to_ns(1 / frequency));
    EXPECT_GT(distance.brightness, 2 * tolerance);
    EXPECT_LT(distance.late_ns, 0.5) << frequency;
  }
}

TEST(Modulation, HasEdgesOfOneNanosecond) {
  const Modulation pwm({100, 0.5, FlickerShape::pwm, 0.3, 0.1}, 0, {});
  const TimeNs ms = kNsPerMs;
  EXPECT_EQ(nodes_between(pwm, 0, 13 * ms),
            (std::vector<TimeNs>{0, 2 * ms - 1, 2 * ms, 9 * ms - 1, 9 * ms, 12 * ms - 1, 12 * ms, 13 * ms}));
  EXPECT_LT(pwm.at(2 * ms), pwm.at(2 * ms - 1));
  EXPECT_GT(pwm.at(9 * ms), pwm.at(9 * ms - 1));
}

TEST(Modulation, HasAllEdgesAtEveryFrequencyAndTime) {
  for (const double frequency : {1e6, 999'983.7, 123'456.78, 0.01}) {
    const double period_ns = 1e9 / frequency;
    for (const TimeNs start : {TimeNs{0}, TimeNs{1'403'636'579'763'555'584}}) {
      const Modulation pwm({frequency, 1, FlickerShape::pwm, 0.37, 0.9}, start, {});
      TimeNs t = start;
      std::vector<TimeNs> rises;
      for (int i = 0; i < 400; ++i) {
        const TimeNs next = pwm.next_node(t);
        ASSERT_GT(next, t);
        if (next > t + 1) {
          EXPECT_EQ(pwm.at(t), pwm.at(next)) << "a missing edge";
          EXPECT_EQ(pwm.at(t), pwm.at(t + (next - t) / 2));
        } else if (pwm.at(next) > pwm.at(t)) {
          rises.push_back(next);
        }
        t = next;
      }
      ASSERT_GE(rises.size(), 99U);
      const double measured = static_cast<double>(rises.back() - rises.front()) / static_cast<double>(rises.size() - 1);
      EXPECT_NEAR(measured / period_ns, 1, 0.02 / period_ns);
    }
  }
}

TEST(Modulation, HasTheSamePhaseFromAnyStart) {
  const Modulation early(kMains, 0, {}), late(kMains, 1234 * kNsPerSecond + 3, {});
  for (TimeNs t = 1234 * kNsPerSecond; t < 1234 * kNsPerSecond + 20 * kNsPerMs; t += 777'777)
    EXPECT_NEAR(early.at(t), late.at(t), 1e-8);
  const TimeNs large = 1'403'636'579'763'555'584;  // of a file
  const Modulation file(kMains, large, {});
  EXPECT_NEAR(file.at(large + 10 * kNsPerMs), file.at(large), 1e-6);
}

TEST(Modulation, HasFewNodesAndEveryNanosecondAtMost) {
  const auto count = [](const FlickerOptions& options, const LightAccuracy& accuracy) {
    const TimeNs period = to_ns(1 / options.frequency_hz);
    return nodes_between(Modulation(options, 0, accuracy), 0, period).size();
  };
  EXPECT_LT(count(kMains, {2e-4, 1e-3}), 100U);
  EXPECT_LT(count({100, 1, FlickerShape::mains}, {2e-4, 1e-30}), 2000U);
  EXPECT_LE(count({1e6, 1, FlickerShape::sine}, {1e-9, 1e-3}), 1001U);
}

TEST(Modulation, IsConstantAtDepthZero) {
  for (const FlickerShape shape : {FlickerShape::mains, FlickerShape::sine, FlickerShape::pwm}) {
    const Modulation modulation({100, 0, shape}, 0, {});
    EXPECT_EQ(modulation.next_node(5), kNever);
    EXPECT_EQ(modulation.at(12345), 1);
  }
}

TEST(Modulation, RefusesOptionsOutOfRange) {
  const auto error = [](const FlickerOptions& options) {
    return test::message_of<UserError>([&] { Modulation(options, 0, {}, "light.flicker"); });
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const FlickerShape pwm = FlickerShape::pwm;
  for (const double frequency : {0.0, -1.0, 1.1e6, nan})
    EXPECT_TRUE(test::contains(error({frequency}), "light.flicker.frequency_hz: must be"));
  for (const double depth : {-0.1, 1.1, nan}) EXPECT_TRUE(test::contains(error({100, depth}), "light.flicker.depth"));
  for (const double duty : {-0.1, 0.0, 1.0, nan})
    EXPECT_TRUE(test::contains(error({100, 1, pwm, duty}), "light.flicker.duty: must be"));
  for (const double phase : {-0.1, 1.1}) {
    EXPECT_TRUE(test::contains(error({100, 1, pwm, 0.5, phase}), "light.flicker.phase"));
  }
  EXPECT_TRUE(test::contains(error({1e6, 1, pwm, 0.005}), "pulses or gaps of 5 ns"));
  EXPECT_TRUE(test::contains(error({1e6, 1, pwm, 0.995}), "pulses or gaps of 5 ns"));
}

}  // namespace
}  // namespace esim
