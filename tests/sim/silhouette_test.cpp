// Events of a straight edge that moves slowly over pixels, with the default engine, against the exact times.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "esim/compose/compose.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

/// The edge of a large bright sheet before a dark background.
struct Silhouette {
  double angle;      // of the normal to the edge, towards the sheet, to the rows of the image
  double direction;  // 1: to the right, so that the sheet leaves; -1: to the left
  double threshold;
};

/// Collects the events of each pixel.
class PixelEvents final : public Sink {
 public:
  void begin(const RecordingInfo&) override {}
  void write(const Record& record) override {
    if (const auto* part = std::get_if<EventsRecord>(&record))
      for (const Event& event : part->events) of[{event.x, event.y}].push_back(event);
  }
  void end(bool) override {}

  std::map<std::pair<int, int>, std::vector<Event>> of;
};

class SlowSilhouette : public testing::TestWithParam<Silhouette> {
 protected:
  static constexpr int kWidth = 24, kHeight = 16;
  static constexpr double kBackground = 0.02, kSheet = 1.0;  // 50 times as bright
  static constexpr double kSpeed = 3;                        // px/s, along the rows
  static constexpr double kDuration_s = 2;
  static constexpr double kStart = -2.3, kSide_m = 20;  // of the edge, px from the image's centre; of the sheet

  SlowSilhouette() {
    // A triangle in the plane x = 0, whose edge goes through the origin. y is to the left, z is up.
    const double a = GetParam().angle;
    std::string vertices;
    for (const auto& [n, s] : {std::pair{0.0, -1.0}, {0.0, 1.0}, {1.0, 0.0}}) {
      const double u = n * std::cos(a) - s * std::sin(a), v = n * std::sin(a) + s * std::cos(a);
      vertices += "v 0 " + std::to_string(-kSide_m * u) + " " + std::to_string(-kSide_m * v) + "\n";
    }
    folder_.write("sheet.obj", "mtllib sheet.mtl\n" + vertices + "usemtl m\nf 1 2 3\n");
    const std::string kd = std::to_string(kSheet);
    folder_.write("sheet.mtl", "newmtl m\nKd " + kd + " " + kd + " " + kd + "\n");
    folder_.write("empty.obj", "v -9 0 0\nv -9 1 0\nv -9 0 1\nf 1 2 3\n");  // behind the camera
  }

  double focal_length() const { return kWidth / 2.0 / std::tan(20 * std::numbers::pi / 180); }

  /// Position of the edge on the row through the image's centre, px from the centre.
  double edge(double t_s) const { return GetParam().direction * (kStart + kSpeed * t_s); }

  /// The brightness of a pixel: the mean over its area, in closed form.
  double brightness(int x, int y, double t_s) const {
    const double c = std::cos(GetParam().angle), s = std::sin(GetParam().angle);
    const double d = (x - (kWidth - 1) / 2.0 - edge(t_s)) * c + (y - (kHeight - 1) / 2.0) * s;
    // The fraction of a square in a half-plane at the distance d: the integral of a box over a box.
    const double big = std::abs(c) / 2, small = std::abs(s) / 2;
    const auto ramp2 = [](double at) { return at > 0 ? at * at / 2 : 0.0; };
    const double area =
        (ramp2(d + big + small) - ramp2(d + big - small) - ramp2(d - big + small) + ramp2(d - big - small)) /
        (4 * big * small);
    return std::log(kBackground + (kSheet - kBackground) * std::clamp(area, 0.0, 1.0) + EventCameraOptions{}.log_eps);
  }

  /// The times at which the brightness of a pixel has changed by one threshold after the other.
  std::vector<double> exact_times(int x, int y) const {
    const double first = brightness(x, y, 0), change = brightness(x, y, kDuration_s) - first;
    std::vector<double> times;
    for (int n = 1; n * GetParam().threshold < std::abs(change); ++n) {
      double before = 0, after = kDuration_s;
      for (int i = 0; i < 60; ++i) {
        const double middle = (before + after) / 2;
        (std::abs(brightness(x, y, middle) - first) < n * GetParam().threshold ? before : after) = middle;
      }
      times.push_back(after);
    }
    return times;
  }

  PixelEvents simulate_with(MeshEngine engine) {
    Scenario scenario;
    scenario.duration_s = kDuration_s;
    MeshRendererOptions mesh;
    mesh.scene = folder_.path() / "empty.obj";
    mesh.engine = engine;
    mesh.samples_per_pixel = 16;
    mesh.background = kBackground;
    constexpr double kDistance_m = 2;
    const auto pose = [&](double t_s) {
      const double y = -edge(t_s) * kDistance_m / focal_length();
      char line[128];
      std::snprintf(line, sizeof line, "%.9f 0 %.12f 0 0 0 0 1\n", t_s, y);
      return std::string(line);
    };
    folder_.write("sheet.txt", pose(0) + pose(kDuration_s / 2) + pose(kDuration_s));
    FileTrajectoryOptions path;
    path.path = folder_.path() / "sheet.txt";
    mesh.objects = {{"sheet", folder_.path() / "sheet.obj", 1.0, path}};
    scenario.renderer = mesh;
    StaticTrajectoryOptions still;
    still.pose.position = {-kDistance_m, 0, 0};
    scenario.trajectory = still;
    CameraOptions camera;
    camera.name = "cam0";
    camera.width = kWidth, camera.height = kHeight;
    camera.horizontal_fov_deg = 40;
    camera.sampling = UniformSampling{2000};
    camera.event_camera.contrast_threshold = GetParam().threshold;
    scenario.cameras = {camera};
    scenario.truth.images = scenario.truth.depth = scenario.truth.motion_field = false;
    PixelEvents events;
    World world = build_world(scenario, 2, {[](const std::string&) {}, [](const std::string&) {}});
    simulate(world, events, [](const Progress&) { return true; });
    return events;
  }

  test::TemporaryDirectory folder_;
};

/// What the events of all pixels have in common.
struct Timing {
  double rms;     // error, in fractions of the time in which the edge moves by one pixel
  double bursts;  // fraction of the successive pairs of events of a pixel that are closer than a tenth of their mean
};

TEST_P(SlowSilhouette, FiresAtTheExactTimesWithoutBursts) {
  const auto timing_of = [&](const PixelEvents& events) {
    double squares = 0, count = 0, pairs = 0, close = 0;
    for (const auto& [pixel, list] : events.of) {
      const std::vector<double> exact = exact_times(pixel.first, pixel.second);
      for (std::size_t i = 0; i < std::min(list.size(), exact.size()); ++i)
        squares += std::pow((to_seconds(list[i].t) - exact[i]) * kSpeed, 2), ++count;
      if (list.size() < 2) continue;
      const auto steps = static_cast<double>(list.size() - 1);
      const double mean = to_seconds(list.back().t - list.front().t) / steps;
      for (std::size_t i = 1; i < list.size(); ++i)
        close += to_seconds(list[i].t - list[i - 1].t) < mean / 10 ? 1 : 0, ++pairs;
    }
    return Timing{std::sqrt(squares / count), close / pairs};
  };
  const PixelEvents events = simulate_with(MeshEngine::processor);
  std::size_t expected = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const std::vector<double> exact = exact_times(x, y);
      const auto found = events.of.find({x, y});
      const std::size_t fired = found == events.of.end() ? 0 : found->second.size();
      EXPECT_EQ(fired, exact.size()) << x << ", " << y;
      expected += exact.size();
    }
  }
  ASSERT_GT(expected, 500U);
  const Timing exact = timing_of(events);
  RecordProperty("rms", std::to_string(exact.rms)), RecordProperty("bursts", std::to_string(exact.bursts));
  EXPECT_LT(exact.rms, 0.001);
  EXPECT_LT(exact.bursts, 0.01);
  // 16 rays fire in bursts at the steps of 1/16: the measures can tell.
  const Timing rays = timing_of(simulate_with(MeshEngine::raycast));
  EXPECT_GT(rays.rms, 0.01);
  EXPECT_GT(rays.bursts, 0.2);
}

INSTANTIATE_TEST_SUITE_P(All, SlowSilhouette,
                         testing::Values(Silhouette{0.1, 1, 0.15}, Silhouette{0.1, -1, 0.15}, Silhouette{0.1, -1, 0.25},
                                         Silhouette{0.5, -1, 0.25}, Silhouette{0.5, 1, 0.25},
                                         Silhouette{-0.8, -1, 0.15}, Silhouette{2.5, 1, 0.25}));

}  // namespace
}  // namespace esim
