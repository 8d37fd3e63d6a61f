#include "esim/imu/imu.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "esim/core/error.h"
#include "support/errors.h"

namespace esim {
namespace {

using test::contains;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

ImuOptions perfect() {
  ImuOptions options;
  options.gyroscope.noise_density = options.gyroscope.random_walk = 0;
  options.accelerometer.noise_density = options.accelerometer.random_walk = 0;
  return options;
}

const InertialSignals kTruth{{0.1, -0.2, 0.3}, {1, 2, -9.81}};

/// The overlapping Allan variance (IEEE Std 952, eq. C.3) of samples every `interval_s` at the time tau = m interval_s:
/// half the mean squared difference of the means over adjoining windows.
double allan_variance(const std::vector<double>& samples, double interval_s, std::size_t m) {
  std::vector<double> integral(samples.size() + 1, 0);
  for (std::size_t k = 0; k < samples.size(); ++k) integral[k + 1] = integral[k] + samples[k] * interval_s;
  double sum = 0;
  const std::size_t count = integral.size() - 2 * m;
  for (std::size_t k = 0; k < count; ++k) {
    const double difference = integral[k + 2 * m] - 2 * integral[k + m] + integral[k];
    sum += difference * difference;
  }
  const double tau = static_cast<double>(m) * interval_s;
  return sum / (2 * tau * tau * static_cast<double>(count));
}

TEST(Imu, AnHourAtRestHasTheAllanDeviationsOfItsNoise) {
  ImuOptions options;
  options.rate_hz = 125;
  constexpr int kSeconds = 3600;
  Imu imu(options, 0, 11);
  std::vector<double> gyroscope[3], accelerometer[3];
  for (TimeNs k = 0; k < kSeconds * 125; ++k) {
    const InertialSignals measured = imu.measure(k * 8 * kNsPerMs, {});
    for (int axis = 0; axis < 3; ++axis) {
      gyroscope[axis].push_back(measured.angular_rate[axis]);
      accelerometer[axis].push_back(measured.specific_force[axis]);
    }
  }
  const auto deviation = [&](const std::vector<double>(&axes)[3], std::size_t tau_s) {
    double variance = 0;
    for (const auto& samples : axes) variance += allan_variance(samples, 0.008, 125 * tau_s) / 3;
    return std::sqrt(variance);
  };
  // White noise N and a random walk K: N²/tau + K² tau/3; the first term dominates at 1 s, the second at 60 s.
  const auto expected = [](const InertialAxesOptions& axes, double tau_s) {
    return std::sqrt(axes.noise_density * axes.noise_density / tau_s + axes.random_walk * axes.random_walk * tau_s / 3);
  };
  const auto expect = [&](const std::vector<double>(&axes)[3], const InertialAxesOptions& sensor) {
    const double at_1_s = deviation(axes, 1);
    EXPECT_NEAR(at_1_s / sensor.noise_density, 1, 0.03);
    EXPECT_NEAR(at_1_s / expected(sensor, 1), 1, 0.02);
    for (const std::size_t tau_s : {30U, 60U}) {
      const auto tau = static_cast<double>(tau_s);
      const double at_tau = deviation(axes, tau_s);
      EXPECT_NEAR(at_tau / (sensor.random_walk * std::sqrt(tau / 3)), 1, 0.15) << tau;
      EXPECT_NEAR(at_tau / expected(sensor, tau), 1, 0.12) << tau;
    }
  };
  expect(gyroscope, options.gyroscope);
  expect(accelerometer, options.accelerometer);
}

TEST(Imu, WithoutErrorsMeasuresTheTruth) {
  Imu imu(perfect(), 0, 1);
  const InertialSignals measured = imu.measure(12'345'678, kTruth);
  EXPECT_EQ(measured.angular_rate, kTruth.angular_rate);
  EXPECT_EQ(measured.specific_force, kTruth.specific_force);
}

TEST(Imu, AppliesScaleMisalignmentBiasAndRangeInThisOrder) {
  ImuOptions options = perfect();
  options.gyroscope.scale = {1.1, 0.9, 2.0};
  options.gyroscope.misalignment << 0.01, 0.02, 0.03, 0.04, 0.05, 0.06;
  options.gyroscope.initial_bias = {0.5, -0.5, 0.25};
  options.accelerometer.initial_bias = {0, 0, 1};
  options.accelerometer.range = 1.5;
  Imu imu(options, 0, 1);
  const InertialSignals measured = imu.measure(0, kTruth);
  const Eigen::Vector3d rate(1.1 * 0.1 + 0.01 * -0.2 + 0.02 * 0.3 + 0.5,  //
                             0.03 * 0.1 + 0.9 * -0.2 + 0.04 * 0.3 - 0.5,  //
                             0.05 * 0.1 + 0.06 * -0.2 + 2.0 * 0.3 + 0.25);
  EXPECT_LT((measured.angular_rate - rate).norm(), 1e-15);
  EXPECT_EQ(measured.specific_force, Eigen::Vector3d(1, 1.5, -1.5));
}

TEST(Imu, WhiteNoiseGrowsWithTheRootOfTheRate) {
  for (const double rate_hz : {100.0, 1000.0}) {
    ImuOptions options = perfect();
    options.rate_hz = rate_hz;
    options.accelerometer.noise_density = 0.01;
    Imu imu(options, 0, 5);
    double sum = 0;
    constexpr int kSamples = 20'000;
    for (int k = 0; k < kSamples; ++k)
      sum += (imu.measure(to_ns(k / rate_hz), kTruth).specific_force - kTruth.specific_force).squaredNorm();
    EXPECT_NEAR(std::sqrt(sum / (3 * kSamples)), 0.01 * std::sqrt(rate_hz), 0.01 * 0.01 * std::sqrt(rate_hz));
  }
}

TEST(Imu, BiasesAreFunctionsOfTimeWhateverTheRateAndTheOrderOfQuestions) {
  ImuOptions options;
  options.gyroscope.initial_bias = {0.1, 0.2, 0.3};
  options.gyroscope.random_walk = 1;
  Imu forwards(options, kNsPerSecond, 9);
  options.rate_hz = 37;
  Imu backwards(options, kNsPerSecond, 9);
  std::vector<Eigen::Vector3d> biases;
  for (int k = 0; k < 1000; ++k) biases.push_back(forwards.bias(kNsPerSecond + k * 1'234'567).angular_rate);
  EXPECT_EQ(biases[0], Eigen::Vector3d(0.1, 0.2, 0.3));
  for (int k = 999; k >= 0; --k) EXPECT_EQ(backwards.bias(kNsPerSecond + k * 1'234'567).angular_rate, biases[k]);
  EXPECT_NE(Imu(options, kNsPerSecond, 10).bias(2 * kNsPerSecond).angular_rate,
            backwards.bias(2 * kNsPerSecond).angular_rate);
}

TEST(Imu, BiasesWalkWithoutJumpsOrCorners) {
  ImuOptions options;
  options.accelerometer.random_walk = 1;
  Imu imu(options, 0, 2);
  const auto bias = [&](TimeNs t) { return imu.bias(t).specific_force.x(); };
  double largest_step = 0;
  for (int step = 1; step < 100; ++step) {
    const TimeNs t = step * BiasWalk::kStep;
    constexpr TimeNs h = 1000;
    const double before = (bias(t) - bias(t - h)) / 1e-6, after = (bias(t + h) - bias(t)) / 1e-6;
    EXPECT_NEAR(before, after, 0.3) << "discontinuous slope at step " << step;  // slopes are of the order of 14
    largest_step = std::max(largest_step, std::abs(bias(t) - bias(t - BiasWalk::kStep)));
  }
  EXPECT_GT(largest_step, std::sqrt(0.005));
  EXPECT_LT(largest_step, 5 * std::sqrt(0.005));
}

TEST(Imu, MeasurementsDoNotDependOnEachOther) {
  Imu all({}, 0, 4), one({}, 0, 4);
  InertialSignals last;
  for (TimeNs t = 0; t <= 100 * kNsPerMs; t += kNsPerMs) last = all.measure(t, kTruth);
  const InertialSignals alone = one.measure(100 * kNsPerMs, kTruth);
  EXPECT_EQ(alone.angular_rate, last.angular_rate);
  EXPECT_EQ(alone.specific_force, last.specific_force);
  EXPECT_THROW(one.measure(-1, kTruth), InternalError);
}

TEST(Imu, RefusesWhatCannotBe) {
  const auto message = [](auto change) {
    ImuOptions options;
    change(options);
    return test::message_of<UserError>([&] { Imu(options, 0, 0); });
  };
  EXPECT_TRUE(contains(message([](ImuOptions& o) { o.rate_hz = 1.001e9; }), "imu.rate_hz"));
  EXPECT_TRUE(contains(message([](ImuOptions& o) { o.rate_hz = 0; }), "imu.rate_hz"));
  EXPECT_TRUE(contains(message([](ImuOptions& o) { o.gyroscope.noise_density = -1; }), "imu.gyroscope.noise_density"));
  EXPECT_TRUE(contains(message([](ImuOptions& o) { o.gyroscope.random_walk = kNan; }), "imu.gyroscope.random_walk"));
  EXPECT_TRUE(
      contains(message([](ImuOptions& o) { o.accelerometer.noise_density = kNan; }), "imu.accelerometer.noise"));
  EXPECT_TRUE(contains(message([](ImuOptions& o) { o.accelerometer.range = -3; }), "imu.accelerometer.range"));
  EXPECT_TRUE(contains(message([](ImuOptions& o) { o.accelerometer.misalignment[3] = kNan; }), "misalignment"));
  EXPECT_TRUE(contains(message([](ImuOptions& o) { o.gravity.y() = kNan; }), "imu.gravity"));
  EXPECT_NO_THROW(Imu({.rate_hz = 1e9}, 0, 0));
}

}  // namespace
}  // namespace esim
