#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "esim/core/error.h"
#include "esim/motion/fit/fit.h"
#include "motion/fit_motions.h"
#include "support/errors.h"

namespace esim {
namespace {

using test::contains;
using test::sample;
using test::smooth_motion;
using test::with_noise;

TEST(FitOptions, ChoosesKnotsToSuitThePoses) {
  const auto interval_for = [](int count, double duration_s) {
    return fit_trajectory(sample([](double) { return SE3(); }, count, duration_s), {}).report.knot_interval_s;
  };
  EXPECT_NEAR(interval_for(201, 1.0), 0.02, 1e-12);       // 200 Hz
  EXPECT_NEAR(interval_for(1001, 1.0), 0.004, 1e-12);     // 1 kHz: four intervals
  EXPECT_NEAR(interval_for(71, 1.0), 2.0 / 70.0, 1e-12);  // 70 Hz: two intervals
  EXPECT_NEAR(interval_for(31, 3.0), 0.05, 1e-12);        // 10 Hz: half an interval
  FitOptions options;
  options.knot_interval_s = 0.3;
  const auto fit = fit_trajectory(sample([](double) { return SE3(); }, 101, 1.0), options);
  EXPECT_NEAR(fit.report.knot_interval_s, 0.25, 1e-12);  // the longest below 0.3 s that divides 1 s
}

TEST(FitOptions, RefusesFaultyPoses) {
  const auto error_of = [](const std::vector<TimedPose>& poses) {
    return test::message_of<UserError>([&] { fit_trajectory(poses, {}); });
  };
  const auto good = sample(smooth_motion, 101, 1.0);
  const auto error_with = [&](auto change) {
    std::vector<TimedPose> poses = good;
    change(poses[40]);
    return error_of(poses);
  };
  EXPECT_EQ(error_of(good), "nothing was thrown");
  EXPECT_TRUE(contains(error_of({}), "0 poses"));
  EXPECT_TRUE(contains(error_of({good[0]}), "1 pose"));
  EXPECT_TRUE(
      contains(error_with([](TimedPose& p) { p.T_world_body.translation.x() = std::nan(""); }), "pose 40 is not"));
  EXPECT_TRUE(contains(error_with([](TimedPose& p) { p.T_world_body.rotation.coeffs().setZero(); }), "pose 40 is not"));
  EXPECT_TRUE(contains(error_with([](TimedPose& p) { p.T_world_body.rotation.x() = std::nan(""); }), "pose 40 is not"));
  EXPECT_TRUE(contains(error_with([&](TimedPose& p) { p.t = good[39].t; }), "pose 40: the stamp"));
  EXPECT_TRUE(contains(error_with([&](TimedPose& p) { p.t = good[38].t; }), "sort the poses"));
  std::vector<TimedPose> with_gap = good;
  with_gap.erase(with_gap.begin() + 30, with_gap.begin() + 60);
  EXPECT_TRUE(contains(error_of(with_gap), "pose 30: no pose in the 0.31 s"));
  std::vector<TimedPose> brief = good;
  for (std::size_t i = 0; i < brief.size(); ++i) brief[i].t = static_cast<TimeNs>(i);
  EXPECT_TRUE(contains(error_of(brief), "span only 100 ns"));
}

TEST(FitOptions, RefusesFaultyOptions) {
  const auto poses = sample(smooth_motion, 101, 1.0);
  const auto error_with = [&](auto change) {
    FitOptions options;
    change(options);
    return test::message_of<UserError>([&] { fit_trajectory(poses, options); });
  };
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(contains(error_with([](FitOptions& o) { o.order = 1; }), "order is 1"));
  EXPECT_TRUE(contains(error_with([](FitOptions& o) { o.order = 7; }), "order is 7"));
  EXPECT_TRUE(contains(error_with([](FitOptions& o) { o.knot_interval_s = -1.0; }), "knot_interval_s is -1"));
  EXPECT_TRUE(contains(error_with([&](FitOptions& o) { o.knot_interval_s = infinity; }), "knot_interval_s is inf"));
  EXPECT_TRUE(contains(error_with([](FitOptions& o) { o.knot_interval_s = 1e-9; }), "too short for 101 poses"));
  EXPECT_TRUE(
      contains(error_with([](FitOptions& o) { o.smoothing_time_s = std::nan(""); }), "smoothing_time_s is nan"));
}

TEST(FitOptions, RefusesKnotsThatCannotFollowTheRotation) {
  const auto poses = sample([](double t) { return SE3{so3_exp({0.0, 20.0 * t, 0.0}), {}}; }, 201, 1.0);
  FitOptions options;
  options.knot_interval_s = 0.2;
  const std::string message = test::message_of<UserError>([&] { fit_trajectory(poses, options); });
  EXPECT_TRUE(contains(message, "turns by 229 degrees between two knots"));
  EXPECT_TRUE(contains(message, "shorter knot interval"));
}

TEST(FitOptions, RefusesControlPointsThatNothingDetermines) {
  const auto poses = sample(smooth_motion, 11, 1.0, 0.3);
  FitOptions options;
  options.knot_interval_s = 0.02;
  for (const int order : {2, 3, 4, 5, 6}) {
    for (const double smoothing_time_s : {1e-9, 1e-7, 1e-5}) {
      options.order = order;
      options.smoothing_time_s = smoothing_time_s;
      const std::string message = test::message_of<UserError>([&] { fit_trajectory(poses, options); });
      EXPECT_TRUE(contains(message, "undetermined")) << order << ' ' << smoothing_time_s;
    }
  }
}

TEST(FitOptions, RefusesRotationsThatAreMostlyNoise) {
  const auto poses = with_noise(sample(smooth_motion, 101, 2.0), 0.3);
  FitOptions options;
  options.knot_interval_s = 0.04;
  options.smoothing_time_s = 0.001;
  const std::string message = test::message_of<UserError>([&] { fit_trajectory(poses, options); });
  EXPECT_TRUE(contains(message, "a longer smoothing time"));
  options.smoothing_time_s = 0.05;
  EXPECT_NO_THROW(fit_trajectory(poses, options));
}

}  // namespace
}  // namespace esim
