#include "esim/evaluate/brightness_errors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "esim/evaluate/tapped_sampler.h"
#include "esim/motion/static.h"
#include "esim/sampling/make_sampler.h"

namespace esim {
namespace {

constexpr int kWidth = 40, kHeight = 30;
constexpr double kLogEps = 0.001;

/// L = A sin(k (x - v t)) + B sin(l (y - w t)).
struct Plaid {
  double a = 0.3, b = 0.2;
  double across_hz = 50, down_hz = 70;  // k v / 2 pi, l w / 2 pi

  double brightness(int x, int y, TimeNs t) const {
    const double turn = 2 * std::numbers::pi, s = to_seconds(t);
    return a * std::sin(turn * (x / 16.0 - across_hz * s)) + b * std::sin(turn * (y / 10.0 - down_hz * s)) - 1;
  }
};

class PlaidRenderer final : public ProcessorRenderer {
 public:
  RendererTraits traits() const override { return {.name = "plaid"}; }
  void compute(std::span<const RenderRequest> requests, Sample& sample) const override {
    const RenderRequest& request = requests[0];
    sample.resize(kWidth, kHeight);
    sample.t = request.t;
    sample.tiles = request.tiles;
    for (const Tile& tile : request.tiles) {
      for (int y = tile.y; y < tile.y + tile.height; ++y) {
        for (int x = tile.x; x < tile.x + tile.width; ++x) {
          sample.irradiance(x, y) = static_cast<float>(std::exp(Plaid{}.brightness(x, y, request.t)) - kLogEps);
          sample.motion_x(x, y) = static_cast<float>(30 + 10 * std::sin(20 * to_seconds(request.t)));
          sample.motion_y(x, y) = 40;
        }
      }
    }
  }
};

World plaid_world(TimeNs end) {
  World world;
  world.info.cameras.push_back({"cam0", Camera::from_fov(kWidth, kHeight, 1.0), SE3{}});
  world.info.end = end;
  world.workers = std::make_unique<const Workers>(1);
  world.trajectory = std::make_shared<const StaticTrajectory>(SE3{}, 0, end);
  CameraChannel& camera = world.cameras.emplace_back();
  camera.renderer = std::make_unique<PlaidRenderer>();
  camera.event_sensors.push_back({EventCamera({}, kWidth, kHeight)});
  return world;
}

/// The errors of all segments of a uniform sampling.
std::vector<BrightnessError> errors_of_uniform(World& world, double rate_hz, double truth_hz,
                                               const std::vector<Window>& windows, std::size_t memory_bytes,
                                               bool in_tiles = false) {
  ReferenceBrightness reference(world, spread_pixels(kWidth, kHeight, 50), truth_hz, kLogEps, memory_bytes);
  BrightnessErrors errors(reference, kWidth, kHeight, windows, 0.1);
  const auto listen = [&](const Tapped& tapped) {
    if (!in_tiles) return errors.add(tapped.segments);
    for (const Segment& whole : tapped.segments) {
      Segment part = whole;
      for (const Tile& tile : {Tile{17, 0, 23, 30}, Tile{0, 13, 17, 17}, Tile{0, 0, 17, 13}}) {
        part.tile = tile;
        errors.add({&part, 1});
      }
    }
  };
  const SamplingContext context{{}, kWidth, kHeight, {world.info.start, world.info.end}, *world.workers};
  TappedSampler sampler(make_sampler(UniformSampling{rate_hz}, context), listen);
  Sample sample;
  while (const auto request = sampler.next()) {
    world.cameras[0].renderer->render(view(world, 0, request->t, request->tiles), sample);
    sampler.accept(sample);
  }
  return errors.finish();
}

/// Mean square error, over phases and time, of a linearly interpolated sinusoid of unit amplitude. theta: phase between
/// two samples.
double mean_square(double theta) {
  return 0.5 * (5.0 / 3 + std::cos(theta) / 3 - 4 * (1 - std::cos(theta)) / (theta * theta));
}

TEST(BrightnessErrors, OfASampledPlaidHaveTheClosedForm) {
  constexpr double kRate_hz = 500;
  const TimeNs end = to_ns(0.2);  // 10 and 14 periods
  World world = plaid_world(end);
  const std::vector<BrightnessError> errors =
      errors_of_uniform(world, kRate_hz, 100 * kRate_hz, {{"all", {0, end}, 0}}, 1 << 26);
  const Plaid plaid;
  const double turn = 2 * std::numbers::pi;
  const double expected = std::sqrt(plaid.a * plaid.a * mean_square(turn * plaid.across_hz / kRate_hz) +
                                    plaid.b * plaid.b * mean_square(turn * plaid.down_hz / kRate_hz));
  ASSERT_EQ(errors.size(), 1U);
  ASSERT_EQ(errors[0].rmse.size(), 50U);
  for (const double rmse : errors[0].rmse) EXPECT_NEAR(rmse, expected, 0.002 * expected);
  EXPECT_NEAR(errors[0].mean_rmse, expected, 0.002 * expected);
  EXPECT_EQ(errors[0].values, 50 * 10000);
  EXPECT_EQ(errors[0].steps, 50 * 100);
  EXPECT_GT(errors[0].max_abs, errors[0].p99_abs / 1.03);
  EXPECT_GT(errors[0].p99_abs, errors[0].mean_abs);
  EXPECT_LT(errors[0].max_abs, 1.01 * (plaid.a * (1 - std::cos(0.5 * turn * plaid.across_hz / kRate_hz)) +
                                       plaid.b * (1 - std::cos(0.5 * turn * plaid.down_hz / kRate_hz))));
}

TEST(BrightnessErrors, AreZeroWhereTheSamplesAreTheReference) {
  const TimeNs end = to_ns(0.05);
  World world = plaid_world(end);
  const auto errors = errors_of_uniform(world, 3000, 3000, {{"all", {0, end}, 0}}, 1 << 26);
  EXPECT_LT(errors[0].max_abs, 2e-6);
  EXPECT_EQ(errors[0].large_steps, 0);
  EXPECT_GT(errors_of_uniform(world, 200, 3000, {{"all", {0, end}, 0}}, 1 << 26)[0].large_steps, 0);
}

TEST(BrightnessErrors, DependNeitherOnTilesNorOnMemory) {
  const TimeNs end = to_ns(0.2);
  World world = plaid_world(end);
  const std::vector<Window> windows = {{"some", {to_ns(0.0305), to_ns(0.1213)}, 0}, {"all", {0, end}, 0}};
  const auto whole = errors_of_uniform(world, 333, 7000, windows, 1 << 26);
  const auto tiles = errors_of_uniform(world, 333, 7000, windows, 1 << 26, true);
  const auto forgetful = errors_of_uniform(world, 333, 7000, windows, 1);
  for (std::size_t w = 0; w < windows.size(); ++w) {
    EXPECT_EQ(whole[w].rmse, tiles[w].rmse);
    EXPECT_EQ(whole[w].rmse, forgetful[w].rmse);
    EXPECT_EQ(whole[w].values, tiles[w].values);
    EXPECT_EQ(whole[w].steps, tiles[w].steps);
    EXPECT_EQ(whole[w].large_steps, tiles[w].large_steps);
  }
  EXPECT_EQ(whole[0].values, 50 * (849 - 213));  // the instants in (0.0305, 0.1213]: k = 214 ... 849
}

TEST(Motion, IsMeasuredOverTime) {
  World world = plaid_world(kNsPerSecond);
  const MotionCurve motion = measure_motion(world, spread_pixels(kWidth, kHeight, 20), 100);
  ASSERT_EQ(motion.mean_px_per_s.size(), 101U);
  EXPECT_NEAR(motion.mean_px_per_s[0], 50, 1e-4);
  EXPECT_NEAR(motion.max_px_per_s, std::hypot(40, 40), 0.01);
  EXPECT_EQ(motion.fastest_turn_deg_per_s, 0);
}

}  // namespace
}  // namespace esim
