#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "esim/core/error.h"
#include "esim/geometry/so3.h"
#include "esim/sampling/disagreement.h"
#include "esim/sampling/keyframes.h"
#include "support/errors.h"

namespace esim {
namespace {

const Workers kWorkers(2);

/// A pattern at infinity whose irradiance changes over time, and a camera that rotates in front of it.
struct Turning {
  double omega = 0;                                                  ///< rad/s about y
  std::function<double(double)> light = [](double) { return 1.0; };  ///< as a function of t, s
  Camera sensor = Camera::from_fov(60, 40, 1.0);
  RendererTraits traits{.name = "test", .at_infinity = true, .wide_pixels = true};
  float flow = 0;  ///< px/s of the sensor; if not 0, replaces the speed from omega

  RenderRequest view(TimeNs t) const {
    RenderRequest request;
    request.t = t;
    request.camera.T_world_body.rotation = so3_exp(Eigen::Vector3d(0, omega * to_seconds(t), 0));
    return request;
  }

  Sample render(const Camera& camera, TimeNs t) const {
    Sample sample;
    sample.resize(camera.width, camera.height);
    sample.t = t;
    sample.depth.fill(std::numeric_limits<float>::infinity());
    const float speed = flow > 0 ? flow : static_cast<float>(std::fabs(omega) * sensor.fx);
    sample.motion_x.fill(speed * static_cast<float>(camera.fx / sensor.fx));
    const Eigen::Quaterniond R = view(t).camera.T_world_body.rotation;
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const Eigen::Vector3d d = R * camera.back_project({x, y})->bearing.normalized();
        const double pattern = 0.5 + 0.3 * std::sin(9 * d.x()) * std::cos(8 * d.y());
        sample.irradiance(x, y) = static_cast<float>(light(to_seconds(t)) * pattern);
      }
    }
    return sample;
  }
};

struct Outcome {
  SamplingStatistics statistics;
  double rmse = 0;      ///< of brightness at the ends of segments
  LogHistogram errors;  ///< of brightness halfway through segments
};

Outcome run(const Turning& scene, const KeyframeSampling& options, double duration_s) {
  const SamplingContext context{{.contrast_threshold = 0.3, .log_eps = 0.001},
                                60,
                                40,
                                {0, to_ns(duration_s)},
                                kWorkers,
                                scene.sensor,
                                scene.traits,
                                [&](TimeNs t) { return scene.view(t); }};
  const auto sampler = make_keyframe_sampler(options, context);
  const Camera camera = lay_out_keyframes(options, context).camera;
  double squared = 0, count = 0;
  LogHistogram errors;
  while (const auto request = sampler->next()) {
    Sample sample = scene.render(request->of_sensor ? scene.sensor : camera, request->t);
    sample.tiles = request->tiles;
    for (auto segments = sampler->accept(sample); !segments.empty(); segments = sampler->more()) {
      for (const Segment& segment : segments) {
        const Sample truth = scene.render(scene.sensor, segment.t1);
        for (std::size_t i = 0; i < truth.irradiance.size(); ++i) {
          const double error =
              std::log((segment.irradiance1.row(0)[i] + 0.001) / (truth.irradiance.pixels()[i] + 0.001));
          squared += error * error;
          ++count;
        }
        const Sample halfway = scene.render(scene.sensor, (segment.t0 + segment.t1) / 2);
        for (std::size_t i = 0; i < halfway.irradiance.size(); ++i) {
          const auto L = [](float irradiance) { return std::log(irradiance + 0.001); };
          const double told = (L(segment.irradiance0.row(0)[i]) + L(segment.irradiance1.row(0)[i])) / 2;
          errors.add(std::fabs(told - L(halfway.irradiance.pixels()[i])));
        }
      }
    }
  }
  return {sampler->statistics(), std::sqrt(squared / count), errors};
}

TEST(Keyframes, AreAsFarApartAsTheImageMoves) {
  Turning scene;
  scene.omega = 2;  // 110 px/s
  const Outcome outcome = run(scene, {.max_displacement_px = 10}, 1.0);
  EXPECT_NEAR(static_cast<double>(outcome.statistics.samples - outcome.statistics.audits), 12, 1);
  EXPECT_EQ(outcome.statistics.audits, 2) << "the first and the seventh of 11 intervals";
  EXPECT_NEAR(static_cast<double>(outcome.statistics.reconstructions), 220, 20) << "half a pixel each";
  EXPECT_EQ(outcome.statistics.bisections, 0);
  EXPECT_LT(outcome.rmse, 1e-3);
  EXPECT_EQ(outcome.statistics.unseen_share, 0);
}

TEST(Keyframes, ComeAtTheLeastRateWhereNothingMoves) {
  const Outcome outcome = run({}, {.bounds = {5, 100}}, 1.0);
  EXPECT_EQ(outcome.statistics.samples, 6 + 1);
  EXPECT_EQ(outcome.statistics.reconstructions, 6);
  EXPECT_LT(outcome.rmse, 1e-6);
}

TEST(Keyframes, AreAddedWhereLightChanges) {
  Turning dimming;
  dimming.light = [](double t) { return t < 0.3 ? 1.0 : t > 0.4 ? 0.2 : 1 - 8 * (t - 0.3); };
  const Outcome loose = run(dimming, {.tolerance = 100, .bounds = {2, 1e5}}, 1.0);
  EXPECT_EQ(loose.statistics.bisections, 0);
  double before = loose.rmse;
  for (const double tolerance : {2.0, 0.5, 0.1}) {
    const Outcome outcome = run(dimming, {.tolerance = tolerance, .bounds = {2, 1e5}}, 1.0);
    EXPECT_GT(outcome.statistics.bisections, 0);
    EXPECT_LT(outcome.rmse, before);
    EXPECT_EQ(outcome.statistics.held_to_max_rate, 0);
    before = outcome.rmse;
  }
}

TEST(Keyframes, MeasureTheErrorThatTheyMake) {
  Turning flicker;
  flicker.omega = 2;
  flicker.light = [](double t) { return 1 + 0.4 * std::sin(70 * t); };
  const Outcome outcome = run(flicker, {.tolerance = 100, .max_displacement_px = 4}, 2.0);
  ASSERT_TRUE(outcome.statistics.measured_error.has_value());
  EXPECT_GT(outcome.errors.mean(), 0.02) << "the keyframes should be too far apart";
  EXPECT_NEAR(outcome.statistics.measured_error->mean / outcome.errors.mean(), 1, 0.25);
  EXPECT_NEAR(outcome.statistics.measured_error->p99 / outcome.errors.quantile(0.99), 1, 0.25);
}

TEST(Keyframes, StopAtTheGreatestRateWhereNoneWouldDo) {
  Turning flicker;
  flicker.light = [](double t) { return std::fmod(t * 9973.31, 1.0) < 0.5 ? 0.2 : 1.0; };
  const Outcome outcome = run(flicker, {.tolerance = 0.1, .bounds = {10, 200}}, 0.5);
  EXPECT_LE(outcome.statistics.samples - outcome.statistics.audits, 101);
  EXPECT_GT(outcome.statistics.held_to_max_rate, 0);
}

TEST(Keyframes, BearMotionThatIsNoNumber) {
  Turning scene;
  scene.flow = std::numeric_limits<float>::infinity();
  EXPECT_EQ(run(scene, {.bounds = {5, 100}}, 1.0).statistics.samples, 6 + 1);
  scene.flow = 1e9F;
  EXPECT_EQ(run(scene, {.bounds = {5, 100}}, 0.1).statistics.samples, 11 + 2);
}

TEST(Keyframes, AreRefusedOnTheSensor) {
  Turning scene;
  scene.traits = {.name = "sprites", .on_sensor = true};
  EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { run(scene, {}, 1.0); }), "use type flow or brightness"));
}

TEST(MeasuredError, KnowsMeanPercentileAndMaximum) {
  LogHistogram histogram;
  EXPECT_EQ(measured_error(histogram).max, 0);
  for (int i = 1; i <= 1000; ++i) histogram.add(i * 1e-3);
  EXPECT_NEAR(measured_error(histogram).mean, 0.5005, 1e-9);
  EXPECT_NEAR(measured_error(histogram).p99, 0.99, 0.03);
  EXPECT_EQ(measured_error(histogram).max, 1.0);
}

}  // namespace
}  // namespace esim
