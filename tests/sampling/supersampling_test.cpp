#include "esim/sampling/keyframes/supersampling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace esim {
namespace {

const Workers kWorkers(2);

/// Stripes at infinity, `period` sensor pixels wide; each pixel sees only one direction.
class Stripes final : public ProcessorRenderer {
 public:
  Stripes(const Camera& camera, double period) : camera_(camera), period_(period) {}
  RendererTraits traits() const override { return {.name = "test", .at_infinity = true}; }

 private:
  void compute(std::span<const RenderRequest> requests, Sample& sample) const override {
    const RenderRequest& request = requests[0];
    sample.resize(camera_.width, camera_.height);
    sample.t = request.t, sample.tiles = request.tiles;
    sample.depth.fill(std::numeric_limits<float>::infinity());
    for (int y = 0; y < camera_.height; ++y) {
      for (int x = 0; x < camera_.width; ++x) {
        const Eigen::Vector3d d = request.camera.T_world_body.rotation * camera_.back_project({x, y})->bearing;
        const double phase = 2 * M_PI * 60 * (d.x() + 0.7 * d.y()) / d.z() / period_;
        sample.irradiance(x, y) = static_cast<float>(0.5 + 0.3 * std::sin(phase));
      }
    }
  }

  Camera camera_;
  double period_;
};

/// The keyframes that the options give for stripes of a period.
KeyframeSetup set_up(double period, const KeyframeSampling& options) {
  Camera sensor = Camera::from_fov(60, 40, 1.0);
  sensor.fx = sensor.fy = 60;
  Stripes renderer(sensor, period);
  const SceneAccess scene{
      sensor, renderer,
      [](TimeNs t) {
        RenderRequest view;
        view.t = t;
        return view;
      },
      [&](const Camera& camera, const std::optional<PixelArea>&) { return std::make_unique<Stripes>(camera, period); }};
  return set_up_keyframes(options, {{.contrast_threshold = 0.3}, 60, 40, {0, kNsPerMs}, kWorkers}, scene);
}

TEST(Supersampling, LowersTheFloorThatItMeasures) {
  double last = 1;
  for (const int s : {1, 2, 3, 4}) {
    const KeyframeSetup setup = set_up(4, {.supersampling = s});
    EXPECT_EQ(setup.layout.supersampling, s);
    EXPECT_LT(setup.resampling_error.p99, 0.7 * last) << s;
    EXPECT_GT(setup.resampling_error.mean, 0) << s << ": looked up between the pixels";
    last = setup.resampling_error.p99;
  }
}

TEST(Supersampling, FollowsFromTheTolerance) {
  const auto chosen = [](double period, double tolerance) {
    const KeyframeSetup setup = set_up(period, {.tolerance = tolerance});
    const int s = setup.layout.supersampling;
    const double most = tolerance * 0.3;
    if (s < kMaxSupersampling) {
      EXPECT_LE(setup.resampling_error.p99, most);
    }
    if (s > kMinSupersampling) {
      EXPECT_GT(set_up(period, {.supersampling = s - 1}).resampling_error.p99, most);
    }
    return s;
  };
  EXPECT_EQ(chosen(20, 0.5), 2);
  EXPECT_EQ(chosen(2.2, 1e-6), 4);
  int last = 4;
  for (const double tolerance : {0.001, 0.01, 0.1, 1.0}) {
    const int s = chosen(3, tolerance);
    EXPECT_LE(s, last);
    last = s;
  }
  EXPECT_EQ(last, 2);
}

TEST(Supersampling, FindsNoErrorUnderEvenLight) { EXPECT_LT(set_up(1e9, {}).resampling_error.max, 1e-5); }

}  // namespace
}  // namespace esim
