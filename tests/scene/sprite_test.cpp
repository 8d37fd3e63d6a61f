#include "esim/scene/sprite.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <numbers>

#include "esim/core/error.h"
#include "support/errors.h"
#include "support/numeric.h"

namespace esim {
namespace {

const std::vector<SpritePose> kPoses = {{-0.4, {10, -20}, -30, {1, 1}, 0},
                                        {0.1, {-5, 7}, 45, {0.5, 1.5}, 0.3},
                                        {0.7, {30, 3}, 400, {-0.5, 2}, -0.2},
                                        {1.5, {0, 0}, 90, {1.2, 0.9}, 0.5}};

SpriteMotion::Parameters value_at(const SpriteMotion& motion, double t_s) { return motion.at(to_ns(t_s)).value; }

TEST(SpriteMotion, PassesThroughItsPoses) {
  for (const auto interpolation : {SpriteInterpolation::spline, SpriteInterpolation::linear}) {
    const SpriteMotion motion(kPoses, interpolation);
    for (const SpritePose& key : kPoses) {
      const SpriteMotion::Parameters value = value_at(motion, key.t_s);
      EXPECT_LT((value.head<2>() - key.position).norm(), 1e-12);
      EXPECT_NEAR(value[2], key.rotation_deg * std::numbers::pi / 180, 1e-12);
      EXPECT_LT((value.segment<2>(3) - key.scale).norm(), 1e-12);
      EXPECT_NEAR(value[5], key.shear, 1e-12);
    }
  }
}

TEST(SpriteMotion, ItsRateIsTheDerivative) {
  const auto largest_error = [](const SpriteMotion& motion, double t_s) {
    const auto derivative = test::numeric_derivative([&](double t) { return value_at(motion, t); }, t_s);
    return test::largest_difference(derivative, motion.at(to_ns(t_s)).rate);
  };
  const SpriteMotion spline(kPoses, SpriteInterpolation::spline), linear(kPoses, SpriteInterpolation::linear);
  for (const double t_s : {-0.39, 0.0, 0.099, 0.3, 0.699, 1.0, 1.49}) EXPECT_LT(largest_error(spline, t_s), 1e-4);
  for (const double t_s : {-0.39, 0.0, 0.3, 1.0}) EXPECT_LT(largest_error(linear, t_s), 1e-4);
}

TEST(SpriteMotion, ASplineHasContinuousVelocityAndAcceleration) {
  const SpriteMotion motion(kPoses, SpriteInterpolation::spline);
  const auto rate_at = [&](double t_s) { return motion.at(to_ns(t_s)).rate; };
  constexpr double kStep = 1e-5;
  for (const double t_s : {0.1, 0.7}) {
    EXPECT_LT(test::largest_difference(rate_at(t_s - 1e-9), rate_at(t_s + 1e-9)), 1e-4);
    const SpriteMotion::Parameters before = (rate_at(t_s) - rate_at(t_s - kStep)) / kStep,
                                   after = (rate_at(t_s + kStep) - rate_at(t_s)) / kStep;
    EXPECT_LT(test::largest_difference(before, after), 0.2) << "accelerations are of the order of 1000";
  }
}

TEST(SpriteMotion, RestsBeforeTheFirstPoseAndAfterTheLast) {
  const SpriteMotion motion(kPoses, SpriteInterpolation::spline);
  EXPECT_EQ(value_at(motion, -3), value_at(motion, -0.4));
  EXPECT_EQ(value_at(motion, 9), value_at(motion, 1.5));
  EXPECT_TRUE(motion.at(to_ns(-3)).rate.isZero() && motion.at(to_ns(9)).rate.isZero());
  EXPECT_FALSE(motion.at(to_ns(1.5)).rate.isZero()) << "at the last pose it still moves";
  const SpriteMotion one({kPoses[0]}, SpriteInterpolation::spline);
  EXPECT_EQ(value_at(one, 5), value_at(motion, -0.4));
  EXPECT_TRUE(one.at(0).rate.isZero());
}

TEST(SpriteMotion, RefusesPosesWithoutOrder) {
  const auto message = [](std::vector<SpritePose> poses) {
    return test::message_of<UserError>([&] { SpriteMotion(poses, SpriteInterpolation::spline); });
  };
  EXPECT_TRUE(test::contains(message({}), "no poses"));
  EXPECT_TRUE(test::contains(message({{0.5, {}, 0, {}}, {0.5, {}, 0, {}}}), "t_s = 0.5"));
  EXPECT_TRUE(test::contains(message({{0.5, {}, 0, {}}, {0.2, {}, 0, {}}}), "must increase"));
}

TEST(SpritePlacement, PutsTheImageWhereThePoseSays) {
  SpriteMotion::State state{SpriteMotion::Parameters::Zero(), SpriteMotion::Parameters::Zero()};
  state.value << 10, -4, std::numbers::pi / 2, 2, 1, 0;
  const SpritePlacement in_pixels = place(state, SpriteUnits::pixel, {30, 20}, {101, 51});
  EXPECT_LT((in_pixels.centre - Eigen::Vector2d(60, 21)).norm(), 1e-12) << "the sensor's middle is pixel (50, 25)";
  EXPECT_LT((in_pixels.A * Eigen::Vector2d(1, 0) - Eigen::Vector2d(0, 60)).norm(), 1e-12)
      << "a quarter turn, clockwise";
  EXPECT_LT((in_pixels.A * Eigen::Vector2d(0, 1) - Eigen::Vector2d(-20, 0)).norm(), 1e-12);

  state.value << 0.5, -0.5, 0, 1, 1, 0;
  const SpritePlacement filling = place(state, SpriteUnits::sensor, {30, 20}, {101, 51});
  EXPECT_LT((filling.centre - Eigen::Vector2d(100.5, -0.5)).norm(), 1e-12) << "the sensor's upper right corner";
  EXPECT_LT((filling.A - Eigen::Matrix2d(Eigen::Vector2d(101, 51).asDiagonal())).norm(), 1e-12);
}

TEST(SpritePlacement, ShearMovesWhatIsBelowToTheRight) {
  SpriteMotion::State state{SpriteMotion::Parameters::Zero(), SpriteMotion::Parameters::Zero()};
  state.value << 0, 0, 0, 1, 2, 0.5;
  const SpritePlacement placement = place(state, SpriteUnits::pixel, {30, 20}, {101, 51});
  EXPECT_LT((placement.A * Eigen::Vector2d(1, 0) - Eigen::Vector2d(30, 0)).norm(), 1e-12);
  EXPECT_LT((placement.A * Eigen::Vector2d(0, 1) - Eigen::Vector2d(20, 40)).norm(), 1e-12)
      << "of what is 40 px further down, by half of that";
}

TEST(SpritePlacement, ItsPivotIsAtThePosition) {
  const SpriteMotion motion(kPoses, SpriteInterpolation::spline);
  const Eigen::Vector2d pivot(0.2, 1.1), middle(50, 25), size(101, 51);
  for (const double t_s : {-0.4, 0.3, 1.5}) {
    const SpriteMotion::State state = motion.at(to_ns(t_s));
    const SpritePlacement in_pixels = place(state, SpriteUnits::pixel, {30, 20}, {101, 51}, pivot);
    const Eigen::Vector2d seen = in_pixels.centre + in_pixels.A * (pivot - Eigen::Vector2d(0.5, 0.5));
    EXPECT_LT((seen - middle - state.value.head<2>()).norm(), 1e-12);
    const SpritePlacement on_sensor = place(state, SpriteUnits::sensor, {30, 20}, {101, 51}, pivot);
    const Eigen::Vector2d seen_there = on_sensor.centre + on_sensor.A * (pivot - Eigen::Vector2d(0.5, 0.5));
    EXPECT_LT((seen_there - middle - size.cwiseProduct(state.value.head<2>())).norm(), 1e-10);
  }
}

TEST(SpritePlacement, ItsRatesAreTheDerivatives) {
  const SpriteMotion motion(kPoses, SpriteInterpolation::spline);
  for (const auto units : {SpriteUnits::pixel, SpriteUnits::sensor}) {
    const auto at = [&](double t_s) { return place(motion.at(to_ns(t_s)), units, {30, 20}, {101, 51}, {0.1, 0.7}); };
    const auto A_rate = test::numeric_derivative([&](double t_s) -> Eigen::Matrix2d { return at(t_s).A; }, 0.3);
    const auto velocity = test::numeric_derivative([&](double t_s) -> Eigen::Vector2d { return at(t_s).centre; }, 0.3);
    EXPECT_LT(test::largest_difference(A_rate, at(0.3).A_rate), 1e-3);
    EXPECT_LT(test::largest_difference(velocity, at(0.3).centre_velocity), 1e-3);
  }
}

}  // namespace
}  // namespace esim
