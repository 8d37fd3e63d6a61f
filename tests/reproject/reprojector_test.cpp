#include "esim/reproject/reprojector.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "esim/core/error.h"
#include "render/scenes.h"

namespace esim {
namespace {

struct Difference {
  double rms = 0, largest = 0;
};

Difference difference(const Image<float>& a, const Image<float>& b) {
  Difference result;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double d = std::fabs(a.pixels()[i] - b.pixels()[i]);
    result.rms += d * d / static_cast<double>(a.size());
    result.largest = std::max(result.largest, d);
  }
  result.rms = std::sqrt(result.rms);
  return result;
}

/// The request of a camera in one of the test scenes, `dt` seconds later.
RenderRequest view_of(const std::string& scene, const Camera& camera, double dt) {
  return {test::kTime + to_ns(dt),
          test::moving_camera(dt),
          {{0, 0, camera.width, camera.height}},
          test::objects_of(scene, dt)};
}

/// A rendered keyframe.
struct Rendered {
  Sample sample;
  KeyframeLight light;
};

/// Renders a keyframe with wide pixels, and with narrow ones too if `narrow`. make(area) makes the renderers.
template <typename Make>
Rendered wide_keyframe(const Make& make, const RenderRequest& request, double supersampling, bool narrow) {
  Rendered result;
  make(PixelArea{supersampling, supersampling})->render(request, result.sample);
  result.light.wide = result.sample.irradiance;
  Sample narrow_sample;
  if (narrow) make(PixelArea{})->render(request, narrow_sample);
  result.light.narrow = narrow_sample.irradiance;
  return result;
}

/// One of the test scenes with two keyframes and the views between them.
class Between {
 public:
  Between(const std::string& name, int distortion, const Workers& workers = test::two_threads(), bool wide = true)
      : name_(name),
        sensor_(test::distorted_camera(distortion)),
        workers_(workers),
        wide_(wide),
        layout_(lay_out_keyframes(sensor_, 2, 12)),
        renderer_(test::make_renderer(name, sensor_, workers)),
        reprojector_(layout_, renderer_->traits().at_infinity, workers,
                     SceneParts(test::deforming_surfaces_of(name), test::objects_of(name).size())) {}

  RenderRequest view(double dt, const Camera& camera) const { return view_of(name_, camera, dt); }

  Rendered render(double dt) const {
    const RenderRequest request = view(dt, layout_.camera);
    const auto make = [&](const PixelArea& area) { return test::make_renderer(name_, layout_.camera, workers_, area); };
    if (wide_) return wide_keyframe(make, request, layout_.supersampling, name_.ends_with("mesh"));
    Rendered result;
    make({})->render(request, result.sample);
    result.light.narrow = result.sample.irradiance;
    return result;
  }

  Keyframe prepare(double dt, Rendered rendered) const {
    Keyframe result;
    reprojector_.prepare(view(dt, layout_.camera), rendered.sample, std::move(rendered.light), result);
    return result;
  }

  Keyframe keyframe(double dt) const { return prepare(dt, render(dt)); }

  Reconstruction reconstruct(const Keyframe& before, const Keyframe& after, double dt, Detail detail = Detail::apart) {
    Reconstruction result;
    reprojector_.reconstruct(before, after, view(dt, sensor_), detail, result);
    return result;
  }

  Sample direct(double dt) const {
    Sample sample;
    renderer_->render(view(dt, sensor_), sample);
    return sample;
  }

 private:
  std::string name_;
  Camera sensor_;
  const Workers& workers_;
  bool wide_;
  KeyframeLayout layout_;
  std::unique_ptr<Renderer> renderer_;
  Reprojector reprojector_;
};

class EveryLens : public testing::TestWithParam<std::tuple<const char*, int>> {};

// Rotation, parallax and lenses: the texture is smooth, so that only interpolation errors remain, except where walls
// meet: there one ray per pixel sees one wall or the other.
TEST_P(EveryLens, ReprojectionIsDirectRendering) {
  const auto [name, distortion] = GetParam();
  Between scene(name, distortion);
  const Keyframe before = scene.keyframe(0), after = scene.keyframe(0.06);
  const double motion = difference(scene.direct(0).irradiance, scene.direct(0.06).irradiance).rms;
  EXPECT_GT(motion, 0.01) << "the test's camera should move";
  for (const double dt : {0.0, 0.02, 0.03, 0.06}) {
    for (const Detail detail : {Detail::apart, Detail::whole}) {
      const Reconstruction found = scene.reconstruct(before, after, dt, detail);
      EXPECT_EQ(found.unseen, 0) << dt;
      const auto [rms, largest] = difference(found.irradiance, scene.direct(dt).irradiance);
      const bool has_edges = std::string(name) == "mesh";
      EXPECT_LT(rms, (has_edges ? 0.15 : 0.02) * motion) << dt;
      EXPECT_LT(largest, has_edges ? 0.5 : 0.02) << dt;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, EveryLens,
                         testing::Combine(testing::Values("panorama", "plane", "mesh"), testing::Values(0, 1, 2, 3)));

TEST(Reprojector, FollowsMovingAndDeformingObjectsAndWhatTheyHide) {
  for (const auto& [name, distortion] : {std::pair{"moving_mesh", 0}, {"moving_mesh", 1}, {"deforming_mesh", 1}}) {
    Between scene(name, distortion);
    const Keyframe before = scene.keyframe(0), after = scene.keyframe(0.1);
    const Sample direct = scene.direct(0.05);
    const Reconstruction found = scene.reconstruct(before, after, 0.05, Detail::whole);

    // On the objects and on the walls, except at their edges.
    std::vector<float> on_objects, on_walls;
    for (int y = 0; y < direct.irradiance.height(); ++y) {
      for (int x = 0; x < direct.irradiance.width(); ++x) {
        auto& errors = direct.object(x, y) > 0 ? on_objects : on_walls;
        errors.push_back(std::fabs(found.irradiance(x, y) - direct.irradiance(x, y)));
      }
    }
    for (auto* errors : {&on_objects, &on_walls}) {
      ASSERT_GT(errors->size(), 500U);
      const auto rank = errors->begin() + static_cast<std::ptrdiff_t>(errors->size() * 85 / 100);
      std::nth_element(errors->begin(), rank, errors->end());
      EXPECT_LT(*rank, 0.02);
    }
    // Without the objects' motion the images would differ.
    const Difference stayed = difference(scene.direct(0).irradiance, direct.irradiance);
    EXPECT_LT(difference(found.irradiance, direct.irradiance).rms, 0.35 * stayed.rms);
  }
}

TEST(Reprojector, DoesNotDependOnThreads) {
  const Workers one(1);
  Between a("moving_mesh", 1), b("moving_mesh", 1, one);
  for (const Detail detail : {Detail::apart, Detail::whole}) {
    const Reconstruction x = a.reconstruct(a.keyframe(0), a.keyframe(0.1), 0.03, detail),
                         y = b.reconstruct(b.keyframe(0), b.keyframe(0.1), 0.03, detail);
    EXPECT_TRUE(std::equal(x.irradiance.pixels().begin(), x.irradiance.pixels().end(), y.irradiance.pixels().begin()));
    EXPECT_EQ(x.unseen, y.unseen);
  }
}

TEST(Reprojector, AveragesFinePixelsWhereTheRendererDoesNot) {
  for (const char* name : {"panorama", "plane"}) {
    Between scene(name, 0, test::two_threads(), false);
    const Reconstruction found = scene.reconstruct(scene.keyframe(0), scene.keyframe(0.06), 0.03);
    EXPECT_LT(difference(found.irradiance, scene.direct(0.03).irradiance).rms, 0.003);
  }
}

TEST(Reprojector, BearsDepthThatIsNoNumber) {
  Between scene("mesh", 0);
  Rendered rendered = scene.render(0);
  Image<float>& depth = rendered.sample.depth;
  depth(100, 80) = std::numeric_limits<float>::quiet_NaN();
  depth(101, 80) = std::numeric_limits<float>::infinity();
  depth(102, 80) = -1;
  depth(103, 80) = 0;
  const Keyframe damaged = scene.prepare(0, std::move(rendered));
  for (const Detail detail : {Detail::apart, Detail::whole}) {
    const Reconstruction found = scene.reconstruct(damaged, scene.keyframe(0.05), 0.02, detail);
    for (const float light : found.irradiance.pixels()) EXPECT_TRUE(light > 0 && light < 2);
  }
}

/// Dark bars 1 m in front of the camera, with the test scenes' wall behind them: each begins at `place(i)` and is
/// `width(i)` wide, px.
template <typename Place, typename Width>
Scene bars(const Camera& camera, int count, const Place& place, const Width& width) {
  Mesh mesh;
  mesh.materials = {{"dark", nullptr, 0.1F}};
  const auto metres = [&](double px) { return static_cast<float>(px / camera.fx); };
  for (int i = 0; i < count; ++i) {
    const float y = metres(place(i)), end = metres(width(i));
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const auto& [across, up] : {std::pair{0.0F, -1.0F}, {end, -1.0F}, {end, 1.0F}, {0.0F, 1.0F}})
      mesh.vertices.emplace_back(1.0F, y + across + 0.3F * up, up);
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
  }
  const Eigen::Vector2f origin(0, 0);
  mesh.texture_uv.resize(mesh.triangles.size(), {origin, origin, origin});
  mesh.material.resize(mesh.triangles.size(), 0);
  Scene scene = still_scene(test::box_mesh());
  scene.objects.push_back({"bars", mesh, false});
  return scene;
}

/// Mean square errors of reconstructions of a scene, with 64 rays per pixel at edges.
struct SquaredErrors {
  double whole = 0, apart = 0;
};

SquaredErrors squared_errors(const Scene& described, const Camera& sensor) {
  const Workers& workers = test::two_threads();
  const auto scene = build_raycast_scene(described);
  const KeyframeLayout layout = lay_out_keyframes(sensor, 3, 8);
  Reprojector reprojector(layout, false, workers);
  const auto make = [&](const Camera& camera, const PixelArea& area) {
    return make_raycast_renderer(scene, {0.5F, 64}, camera, workers, ColourFilters::none, area);
  };
  Keyframe before, after;
  for (auto [keyframe, dt] : {std::pair{&before, 0.0}, {&after, 0.06}}) {
    const RenderRequest view = view_of("mesh", layout.camera, dt);
    const auto make_keyframes = [&](const PixelArea& area) { return make(layout.camera, area); };
    Rendered rendered = wide_keyframe(make_keyframes, view, layout.supersampling, true);
    reprojector.prepare(view, rendered.sample, std::move(rendered.light), *keyframe);
  }
  SquaredErrors errors;
  for (const double dt : {0.01, 0.03, 0.05}) {
    Sample direct;
    make(sensor, {})->render(view_of("mesh", sensor, dt), direct);
    for (auto [detail, sum] : {std::pair{Detail::whole, &errors.whole}, {Detail::apart, &errors.apart}}) {
      Reconstruction found;
      reprojector.reconstruct(before, after, view_of("mesh", sensor, dt), detail, found);
      *sum += std::pow(difference(found.irradiance, direct.irradiance).rms, 2);
    }
  }
  return errors;
}

TEST(Reprojector, SeesEdgesAsFinelyAsItsKeyframes) {
  double whole = 0, apart = 0;
  for (const int distortion : {0, 2}) {
    const Camera sensor = test::distorted_camera(distortion);
    const auto place = [&](int i) { return (0.1 * i - 0.55) * sensor.fx; };
    const auto width = [](int i) { return 1 + 0.2 * i; };
    const SquaredErrors errors = squared_errors(bars(sensor, 12, place, width), sensor);
    whole += errors.whole, apart += errors.apart;
  }
  EXPECT_LT(whole, 0.75 * apart);
}

TEST(Reprojector, SeesThroughNarrowGaps) {
  // Gaps of 1.6 px: some pixels see only the wall, but a keyframe's wide pixels may not.
  const Camera sensor = test::distorted_camera(0);
  const auto place = [](int i) { return 5.6 * i - 70; };
  const auto width = [](int) { return 4.0; };
  const SquaredErrors errors = squared_errors(bars(sensor, 25, place, width), sensor);
  EXPECT_LT(errors.whole, 0.3 * errors.apart);
}

TEST(KeyframeLayout, PutsTheSensorsPixelsIntoItsMiddle) {
  const Camera sensor = test::distorted_camera(2);
  const KeyframeLayout layout = lay_out_keyframes(sensor, 3, 7);
  EXPECT_EQ(layout.camera.width, 3 * (120 + 14));
  const auto bearing = sensor.back_project({10, 20})->bearing;
  const auto there = layout.camera.project(bearing)->pixel;
  EXPECT_NEAR(there.x(), 3 * (10 + 7 + 0.5) - 0.5, 1e-9);
  EXPECT_NEAR(there.y(), 3 * (20 + 7 + 0.5) - 0.5, 1e-9);
}

TEST(KeyframeLayout, EndsWhereTheLensDoes) {
  Camera sensor = test::distorted_camera(1);
  sensor.distortion = RadialTangential{-0.2, 0.0, 0, 0, 0};
  const KeyframeLayout layout = lay_out_keyframes(sensor, 2, 500);
  EXPECT_LT(layout.margin_px, 500);
  EXPECT_NO_THROW(layout.camera.validate());
}

}  // namespace
}  // namespace esim
