#include "esim/sampling/supersampling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "esim/sampling/keyframes.h"

namespace esim {
namespace {

const Workers kWorkers(2);
constexpr RendererTraits kTraits{.name = "test", .at_infinity = true, .wide_pixels = true};

/// Stripes at infinity, `period` sensor pixels wide; each pixel sees only one direction.
class Stripes final : public ProcessorRenderer {
 public:
  Stripes(const Camera& camera, double period) : camera_(camera), period_(period) {}
  RendererTraits traits() const override { return kTraits; }

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

struct Setting {
  explicit Setting(double stripes) : period(stripes) {}

  double period;
  Camera sensor = [] {
    Camera camera = Camera::from_fov(60, 40, 1.0);
    camera.fx = camera.fy = 60;
    return camera;
  }();
  SamplingContext context{{.contrast_threshold = 0.3}, 60, 40, {0, kNsPerMs}, kWorkers, sensor, kTraits, [](TimeNs t) {
                            RenderRequest view;
                            view.t = t;
                            return view;
                          }};
  Stripes renderer{sensor, period};

  KeyframeSampling decide(const KeyframeSampling& options) {
    return decide_supersampling(options, RenderRequest{}, context, renderer,
                                [&](const Camera& camera) { return std::make_unique<Stripes>(camera, period); });
  }
};

TEST(Supersampling, LowersTheFloorThatItMeasures) {
  double last = 1;
  for (const int s : {1, 2, 3, 4}) {
    Setting setting(4);
    EXPECT_EQ(setting.decide({.supersampling = s}).supersampling, s);
    ASSERT_TRUE(setting.context.resampling_floor.has_value());
    EXPECT_LT(setting.context.resampling_floor->p99, 0.7 * last) << s;
    EXPECT_GT(setting.context.resampling_floor->mean, 0) << s << ": looked up between the pixels";
    last = setting.context.resampling_floor->p99;
  }
}

TEST(Supersampling, FollowsFromTheTolerance) {
  const auto chosen = [](double period, double tolerance) {
    Setting setting(period);
    const int s = setting.decide({.tolerance = tolerance}).supersampling;
    const double most = tolerance * 0.3;
    if (s < kMostSupersampling) {
      EXPECT_LE(setting.context.resampling_floor->p99, most);
    }
    if (s > kLeastSupersampling) {
      Setting coarser(period);
      coarser.decide({.supersampling = s - 1});
      EXPECT_GT(coarser.context.resampling_floor->p99, most);
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

TEST(Supersampling, FindsNoFloorUnderAnEvenLight) {
  Setting setting(1e9);
  setting.decide({});
  EXPECT_LT(setting.context.resampling_floor->max, 1e-5);
}

}  // namespace
}  // namespace esim
