#include "esim/sampling/make_sampler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "esim/sampling/criterion.h"

namespace esim {
namespace {

const Workers kWorkers(2);
constexpr int kWidth = 50, kHeight = 70;

/// A sample in which the brightness rises by `gradient` per pixel to the right and everything moves by (vx, vy).
Sample moving_ramp(TimeNs t, float gradient, float vx, float vy, double log_eps, int width = kWidth,
                   int height = kHeight) {
  Sample sample;
  sample.resize(width, height);
  sample.t = t;
  sample.tiles = {sample.irradiance.bounds()};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      sample.irradiance(x, y) = static_cast<float>(std::exp(gradient * static_cast<float>(x - kWidth)) - log_eps);
      sample.motion_x(x, y) = vx;
      sample.motion_y(x, y) = vy;
    }
  }
  return sample;
}

SamplingContext context(const TimeSpan& span) { return {{}, kWidth, kHeight, span, kWorkers}; }

/// The moving ramp, infinitely far away, for a camera of any size.
class RampRenderer final : public ProcessorRenderer {
 public:
  explicit RampRenderer(const Camera& camera) : camera_(camera) {}
  RendererTraits traits() const override { return {.name = "test", .at_infinity = true}; }

 private:
  void compute(std::span<const RenderRequest> requests, Sample& sample) const override {
    sample = moving_ramp(requests[0].t, 0.05F, 100.0F, 200.0F, 0.001, camera_.width, camera_.height);
    sample.tiles.clear();
    for (const RenderRequest& request : requests)
      sample.tiles.insert(sample.tiles.end(), request.tiles.begin(), request.tiles.end());
  }

  Camera camera_;
};

/// A camera at rest in front of the ramp.
struct RampScene {
  Camera camera = Camera::from_fov(kWidth, kHeight, 1.0);
  RampRenderer renderer{camera};
  SceneAccess access{
      camera, renderer,
      [](TimeNs t) {
        RenderRequest view;
        view.t = t;
        return view;
      },
      [](const Camera& other, const std::optional<PixelArea>&) { return std::make_unique<RampRenderer>(other); }};
};

class EverySampler : public testing::TestWithParam<SamplingOptions> {};

// The contract of Sampler: each pixel has contiguous segments from an instant at the start exactly to the end, and the
// watermark advances with them.
TEST_P(EverySampler, KeepsItsContract) {
  const TimeSpan span{-3 * kNsPerMs, 17 * kNsPerMs + 123};
  RampScene scene;
  const auto sampler = make_sampler(GetParam(), context(span), &scene.access);
  EXPECT_EQ(sampler->watermark(), span.start);
  Image<TimeNs> known(kWidth, kHeight, span.start);
  Image<int> segments(kWidth, kHeight, 0);
  const auto take = [&](const Segment& segment) {
    for (int y = segment.tile.y; y < segment.tile.y + segment.tile.height; ++y) {
      for (int x = segment.tile.x; x < segment.tile.x + segment.tile.width; ++x) {
        ASSERT_EQ(segment.t0, known(x, y));
        ASSERT_TRUE(segments(x, y)++ == 0 ? segment.t1 == segment.t0 : segment.t1 > segment.t0);
        known(x, y) = segment.t1;
      }
    }
  };
  std::int64_t samples = 0, evaluations = 0;
  TimeNs watermark = span.start;
  while (const auto request = sampler->next()) {
    EXPECT_EQ(request->t, sampler->next()->t) << "next() is not idempotent";
    ASSERT_TRUE(samples == 0 ? request->t == span.start : request->t > sampler->watermark()) << "requests a known time";
    ASSERT_LE(request->t, span.end);
    Renderer& renderer = request->renderer != nullptr ? *request->renderer : scene.renderer;
    std::vector<RenderRequest> views = {{.t = request->t, .camera = {}, .tiles = request->tiles}};
    for (const auto& [t, tiles] : request->later) views.push_back({.t = t, .camera = {}, .tiles = tiles});
    Sample sample;
    renderer.start_together(std::move(views))->finish(sample);
    for (const Tile& tile : sample.tiles) evaluations += static_cast<std::int64_t>(tile.area());
    for (auto found = sampler->accept(sample); !found.empty(); found = sampler->more()) {
      for (const Segment& segment : found) take(segment);
    }
    EXPECT_TRUE(sampler->more().empty());
    const auto times = known.pixels();
    EXPECT_LE(sampler->watermark(), *std::min_element(times.begin(), times.end()));
    EXPECT_GE(sampler->watermark(), watermark);
    watermark = sampler->watermark();
    ++samples;
  }
  EXPECT_EQ(watermark, span.end);
  EXPECT_EQ(sampler->statistics().samples, samples);
  EXPECT_EQ(sampler->statistics().pixel_evaluations, evaluations);
}

INSTANTIATE_TEST_SUITE_P(Options, EverySampler,
                         testing::Values(SamplingOptions(UniformSampling{1234}), SamplingOptions(FlowSampling{}),
                                         SamplingOptions(BrightnessSampling{}),
                                         SamplingOptions(FlowSampling{0.5, {5000, 6000}}),
                                         SamplingOptions(AdaptiveSampling{}),
                                         SamplingOptions(AdaptiveSampling{.tolerance = 0, .tile_px = 7}),
                                         SamplingOptions(KeyframeSampling{}),
                                         SamplingOptions(KeyframeSampling{.tolerance = 0, .supersampling = 1})));

TEST(FrameSampler, HandsOutWhatWasRendered) {
  const auto sampler = make_sampler(FlowSampling{}, context({0, 5 * kNsPerMs}));
  while (const auto request = sampler->next()) {
    const TimeNs t = request->t;
    Sample sample = moving_ramp(t, 0.05F, 100.0F, 200.0F, 0.001);
    const Image<float> rendered = sample.irradiance;
    const auto segments = sampler->accept(sample);
    ASSERT_EQ(segments.size(), 1U);
    EXPECT_EQ(segments[0].t1, t);
    EXPECT_EQ(segments[0].irradiance1.row(0)[5], rendered.pixels()[5]);
  }
}

TEST(FlowSampling, BoundsTheMotionBetweenSamples) {
  Sample sample = moving_ramp(0, 0.1F, 30.0F, -40.0F, 0.001);
  EXPECT_NEAR(fastest_motion_px_per_s(sample, kWorkers), 50.0, 1e-4);
  sample.motion_x(kWidth - 1, kHeight - 1) = 300.0F;
  sample.motion_y(kWidth - 1, kHeight - 1) = 400.0F;
  EXPECT_NEAR(wanted_interval_s(FlowSampling{.lambda = 0.25, .bounds = {}}, {}, sample, kWorkers), 0.25 / 500, 1e-8);
}

TEST(FlowSampling, IgnoresMotionThatIsNotFinite) {
  Sample sample = moving_ramp(0, 0.1F, 3.0F, 4.0F, 0.001);
  sample.motion_x(1, 1) = std::numeric_limits<float>::quiet_NaN();
  sample.motion_y(2, 1) = std::numeric_limits<float>::infinity();
  EXPECT_NEAR(fastest_motion_px_per_s(sample, kWorkers), 5.0, 1e-5);
}

TEST(BrightnessSampling, BoundsTheChangeBetweenSamples) {
  // dL/dt = gradient * v; the interval is lambda C / |dL/dt|, including the C that the original omitted.
  const Sample sample = moving_ramp(0, 0.07F, -90.0F, 12.0F, 0.01);
  EXPECT_NEAR(fastest_brightness_change_per_s(sample, 0.01, kWorkers), 0.07 * 90, 1e-3);
  const SensorTraits sensor{.contrast_threshold = 0.3, .log_eps = 0.01};
  EXPECT_NEAR(wanted_interval_s(BrightnessSampling{.lambda = 0.5, .bounds = {}}, sensor, sample, kWorkers),
              0.5 * 0.3 / (0.07 * 90), 1e-5);
}

TEST(BrightnessSampling, SeesTheImagesBorder) {
  Sample sample = moving_ramp(0, 0.0F, 10.0F, 0.0F, 0.001);
  sample.irradiance(0, 3) *= std::exp(1.0F);  // one-sided difference: 1 per pixel; half of that at its neighbour
  EXPECT_NEAR(fastest_brightness_change_per_s(sample, 0.001, kWorkers), 10.0, 0.05);
}

TEST(BrightnessSampling, ComparesPixelsOfTheSameColourInAMosaic) {
  // Uniform red light: differences between neighbours are not edges, also at the border.
  Sample sample = moving_ramp(0, 0.0F, 10.0F, 12.0F, 0.001);
  for (int y = 0; y < sample.irradiance.height(); ++y) {
    for (int x = 0; x < sample.irradiance.width(); ++x) sample.irradiance(x, y) = x % 2 + y % 2 == 0 ? 0.9F : 0.1F;
  }
  EXPECT_EQ(fastest_brightness_change_per_s(sample, 0.001, kWorkers, true), 0);
  EXPECT_GT(fastest_brightness_change_per_s(sample, 0.001, kWorkers, false), 10);
  const Sample ramp = moving_ramp(0, 0.07F, -90.0F, 12.0F, 0.01);
  EXPECT_NEAR(fastest_brightness_change_per_s(ramp, 0.01, kWorkers, true), 0.07 * 90, 1e-3);
}

std::vector<TimeNs> sample_times(const SamplingOptions& options, float speed, TimeNs end) {
  const auto sampler = make_sampler(options, {{}, kWidth, kHeight, {0, end}, kWorkers});
  std::vector<TimeNs> times;
  while (const auto request = sampler->next()) {
    Sample sample = moving_ramp(request->t, 0.1F, speed, 0, 0.001);
    sampler->accept(sample);
    times.push_back(request->t);
  }
  return times;
}

TEST(FrameSampler, KeepsToItsRates) {
  EXPECT_EQ(sample_times(UniformSampling{100}, 0, kNsPerSecond).size(), 101U);
  EXPECT_EQ(sample_times(FlowSampling{0.5, {200, 1000}}, 0, kNsPerSecond).size(), 201U)
      << "nothing moves: the minimum rate";
  EXPECT_EQ(sample_times(FlowSampling{0.5, {200, 1000}}, 1e9F, kNsPerSecond).size(), 1001U)
      << "too fast: the maximum rate";
  EXPECT_EQ(sample_times(FlowSampling{0.5, {10, 10000}}, 250, kNsPerSecond).size(), 501U);
}

TEST(FrameSampler, CountsIntervalsHeldToTheGreatestRate) {
  const auto sampler = make_sampler(FlowSampling{0.5, {10, 1000}}, {{}, kWidth, kHeight, {0, 5 * kNsPerMs}, kWorkers});
  while (const auto request = sampler->next()) {
    Sample sample = moving_ramp(request->t, 0.1F, 1e6F, 0, 0.001);
    sampler->accept(sample);
  }
  EXPECT_EQ(sampler->statistics().held_to_max_rate, 5);
}

}  // namespace
}  // namespace esim
