#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "esim/core/error.h"
#include "esim/geometry/so3.h"
#include "esim/sampling/keyframes/keyframe_renderer.h"
#include "esim/sampling/keyframes/keyframe_sampler.h"
#include "support/errors.h"
#include "support/named_result.h"

namespace esim {
namespace {

const Workers kWorkers(2);

/// A pattern at infinity whose irradiance changes over time, and a camera that rotates in front of it.
struct Turning {
  double omega = 0;                                                  ///< rad/s about y
  std::function<double(double)> light = [](double) { return 1.0; };  ///< as a function of t, s
  Camera sensor = Camera::from_fov(60, 40, 1.0);
  RendererTraits traits{.name = "test", .at_infinity = true};
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

/// The pattern as a camera sees it.
class TurningRenderer final : public ProcessorRenderer {
 public:
  TurningRenderer(const Turning& scene, const Camera& camera) : scene_(scene), camera_(camera) {}
  RendererTraits traits() const override { return scene_.traits; }

 private:
  void compute(std::span<const RenderRequest> requests, Sample& sample) const override {
    sample = scene_.render(camera_, requests[0].t);
    sample.tiles = requests[0].tiles;
  }

  const Turning& scene_;
  Camera camera_;
};

struct Outcome {
  SamplingStatistics statistics;
  double rmse = 0;      ///< of brightness at the ends of segments
  LogHistogram errors;  ///< of brightness halfway through segments

  std::int64_t reconstructions() const {
    return test::named_result<std::int64_t>(statistics, "reconstructions").value_or(-1);
  }
};

Outcome run(const Turning& scene, const KeyframeSampling& options, double duration_s) {
  const SamplingContext context{{.contrast_threshold = 0.3}, 60, 40, {0, to_ns(duration_s)}, kWorkers};
  TurningRenderer sensor(scene, scene.sensor);
  const SceneAccess access{scene.sensor, sensor, [&](TimeNs t) { return scene.view(t); },
                           [&](const Camera& camera, const std::optional<PixelArea>&) {
                             return std::make_unique<TurningRenderer>(scene, camera);
                           }};
  const auto sampler = make_keyframe_sampler(options, context, &access);
  double squared = 0, count = 0;
  LogHistogram errors;
  while (const auto request = sampler->next()) {
    Renderer& renderer = request->renderer != nullptr ? *request->renderer : sensor;
    RenderRequest view = scene.view(request->t);
    view.tiles = request->tiles;
    Sample sample;
    renderer.render(view, sample);
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
  EXPECT_NEAR(static_cast<double>(outcome.reconstructions()), 220, 20) << "half a pixel each";
  EXPECT_EQ(outcome.statistics.bisections, 0);
  EXPECT_LT(outcome.rmse, 1e-3);
  EXPECT_EQ(test::named_result<double>(outcome.statistics, "unseen_fraction"), 0.0);
}

TEST(Keyframes, ComeAtTheLeastRateWhereNothingMoves) {
  const Outcome outcome = run({}, {.bounds = {5, 100}}, 1.0);
  EXPECT_EQ(outcome.statistics.samples, 6 + 1);
  EXPECT_EQ(outcome.reconstructions(), 6);
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

TEST(Keyframes, AreRefusedWithoutAScene) {
  const SamplingContext context{{}, 60, 40, {0, kNsPerMs}, kWorkers};
  const auto make = [&] { make_keyframe_sampler({}, context, nullptr); };
  EXPECT_TRUE(test::contains(test::message_of<UserError>(make), "use type flow or brightness"));
}

TEST(Keyframes, AreRefusedForColourFilters) {
  const Turning scene;
  TurningRenderer sensor(scene, scene.sensor);
  const SamplingContext context{{.mosaic = true}, 60, 40, {0, kNsPerMs}, kWorkers};
  const SceneAccess access{scene.sensor, sensor, [&](TimeNs t) { return scene.view(t); }, {}};
  const auto make = [&] { make_keyframe_sampler({}, context, &access); };
  EXPECT_TRUE(test::contains(test::message_of<UserError>(make), "different colours"));
}

/// Shows how wide its pixels are: E is the side for edges, Z that for textures; the pixels' own are 1 and 1.
class AreaRenderer final : public ProcessorRenderer {
 public:
  AreaRenderer(const Camera& camera, const PixelArea& area, bool has_edges)
      : camera_(camera), area_(area), has_edges_(has_edges) {}
  RendererTraits traits() const override { return {.name = "test", .has_edges = has_edges_}; }

 private:
  void compute(std::span<const RenderRequest> requests, Sample& sample) const override {
    sample.resize(camera_.width, camera_.height);
    sample.t = requests[0].t, sample.tiles = requests[0].tiles;
    sample.irradiance.fill(static_cast<float>(area_.edges));
    sample.depth.fill(static_cast<float>(area_.texture));
  }

  Camera camera_;
  PixelArea area_;
  bool has_edges_;
};

struct Lit {
  KeyframeLight light;
  Sample sample;
};

/// One keyframe of a scene, whose renderer averages over other areas or does not.
Lit keyframe_of(int supersampling, bool averages, bool has_edges = true) {
  const Camera sensor = Camera::from_fov(8, 6, 1.0);
  AreaRenderer renderer(sensor, {}, has_edges);
  const SceneAccess access{sensor, renderer, {}, [&](const Camera& camera, const std::optional<PixelArea>& area) {
                             if (area && !averages) return std::unique_ptr<AreaRenderer>();
                             return std::make_unique<AreaRenderer>(camera, area.value_or(PixelArea{}), has_edges);
                           }};
  const KeyframeLayout layout = lay_out_keyframes(sensor, supersampling, 1);
  KeyframeRenderer keyframes(layout, access);
  Lit result;
  for (int i = 0; i < 2; ++i) {  // the second time with used buffers
    keyframes.render({.t = 5, .camera = {}, .tiles = {{0, 0, layout.camera.width, layout.camera.height}}},
                     result.sample);
    result.light = keyframes.take_light(result.sample);
  }
  EXPECT_EQ(result.sample.t, 5);
  EXPECT_EQ(result.sample.depth.width(), layout.camera.width);
  return result;
}

TEST(KeyframeRenderer, RendersWideAndNarrowPixelsIfItCan) {
  const Lit both = keyframe_of(3, true);
  EXPECT_EQ(both.light.wide(4, 5), 3);
  EXPECT_EQ(both.light.narrow(4, 5), 1);
  EXPECT_EQ(both.sample.depth(4, 5), 3);

  const Lit wide = keyframe_of(3, true, false);
  EXPECT_EQ(wide.light.wide(4, 5), 3);
  EXPECT_TRUE(wide.light.narrow.empty());

  const Lit narrow = keyframe_of(3, false);
  EXPECT_TRUE(narrow.light.wide.empty());
  EXPECT_EQ(narrow.light.narrow(4, 5), 1);
  EXPECT_EQ(narrow.sample.depth(4, 5), 1);
}

TEST(KeyframeRenderer, RendersOnceWithoutSupersampling) {
  const Lit lit = keyframe_of(1, true);
  EXPECT_EQ(lit.light.wide(4, 5), 1);
  EXPECT_TRUE(lit.light.narrow.empty());
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
