// Colour cameras within simulations: what a scenario's files show through filters, and what is refused.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "esim/compose/compose.h"
#include "esim/core/error.h"
#include "esim/scene/planes.h"
#include "esim/sim/simulate.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

const Notices kSilent{[](const std::string&) {}, [](const std::string&) {}};

/// Light of the 8-bit codes 200, 120, 40: red, green, blue.
const std::array<double, 3> kLight = {linear_from_srgb(200.0F / 255), linear_from_srgb(120.0F / 255),
                                      linear_from_srgb(40.0F / 255)};

class ColourCamera : public testing::Test {
 protected:
  void SetUp() override {
    cv::imwrite((folder_.path() / "paint.png").string(), cv::Mat(8, 16, CV_8UC3, cv::Scalar(40, 120, 200)));
    folder_.write("paint.mtl", "newmtl plain\nKd 0.6 0.3 0.1\nnewmtl image\nKd 1 1 1\nmap_Kd paint.png\n");
    folder_.write("wall.obj",
                  "mtllib paint.mtl\nv -9 -9 2\nv 9 -9 2\nv 9 9 2\nv -9 9 2\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
                  "usemtl plain\nf 1/1 2/2 3/3\nusemtl image\nf 1/1 3/3 4/4\n");
    StaticTrajectoryOptions still;
    still.pose.quaternion = Eigen::Vector4d(0, 0, 0, 1);
    scenario_.trajectory = still;
    scenario_.duration_s = 0.1;
    scenario_.truth.rate_hz = 0;
    CameraOptions camera;
    camera.name = "cam0";
    camera.width = 25, camera.height = 20;
    camera.colour = ColourFilters::rggb;
    scenario_.cameras = {camera};
  }

  Sample first_sample(std::size_t camera = 0) const {
    const World world = build_world(scenario_, 1, kSilent);
    Sample sample;
    world.cameras[camera].renderer->render(view(world, camera, world.info.start), sample);
    return sample;
  }

  std::string refusal() const {
    return test::message_of<UserError>([&] { build_world(scenario_, 1, kSilent); });
  }

  static void expect_mosaic(const Image<float>& image, const std::array<double, 3>& light) {
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        const double expected = light[static_cast<std::size_t>(x % 2 + y % 2)];
        ASSERT_NEAR(image(x, y), expected, 5e-4 * expected) << x << ", " << y;
      }
    }
  }

  MeshRendererOptions wall() const {
    MeshRendererOptions mesh;
    mesh.scene = folder_.path() / "wall.obj";
    mesh.samples_per_pixel = 16;
    return mesh;
  }

  test::TemporaryDirectory folder_;
  Scenario scenario_;
};

TEST_F(ColourCamera, SeesTheColoursOfImageFiles) {
  PanoramaRendererOptions panorama;
  panorama.image = folder_.path() / "paint.png";
  scenario_.renderer = panorama;
  expect_mosaic(first_sample().irradiance, kLight);
  PlaneRendererOptions plane;
  plane.image = panorama.image;
  plane.gaussian_px = 1.5;
  plane.endless = true;
  plane.pose.position = {0, 0, 1};
  scenario_.renderer = plane;
  expect_mosaic(first_sample().irradiance, kLight);
}

TEST_F(ColourCamera, SeesTheColoursOfMaterials) {
  scenario_.renderer = wall();
  const Image<float> image = first_sample().irradiance;
  constexpr std::array<double, 3> kPlain = {0.6, 0.3, 0.1};  // Kd
  const int right = image.width() - 1, bottom = image.height() - 1;
  const auto near = [](double value, double expected) { return std::abs(value - expected) < 1e-3 * expected; };
  int plain = 0, textured = 0;
  for (int y = 0; y <= bottom; ++y) {
    for (int x = 0; x <= right; ++x) {
      const auto colour = static_cast<std::size_t>(x % 2 + y % 2);
      const double seen = double{image(x, y)}, a = kPlain[colour], b = kLight[colour];
      plain += near(seen, a), textured += near(seen, b);
      ASSERT_TRUE(seen > std::min(a, b) * 0.999 && seen < std::max(a, b) * 1.001) << "between both on their edge";
    }
  }
  EXPECT_GT(plain, 200);
  EXPECT_GT(textured, 200);
  EXPECT_GT(plain + textured, 440);
}

TEST_F(ColourCamera, SeesWithLuminanceWhatAGreyCameraBesideSees) {
  scenario_.renderer = wall();
  scenario_.cameras.push_back(scenario_.cameras[0]);
  scenario_.cameras[1].name = "cam1";
  scenario_.cameras[1].colour = ColourFilters::none;
  const Sample beside = first_sample(1);
  scenario_.cameras.erase(scenario_.cameras.begin());
  const Sample alone = first_sample();
  EXPECT_TRUE(std::ranges::equal(beside.irradiance.pixels(), alone.irradiance.pixels()));
}

/// Frames of a camera at rest, without noise.
class LastFrame final : public Sink {
 public:
  void begin(const RecordingInfo&) override {}
  void write(const Record& record) override {
    if (const auto* frame = std::get_if<FrameRecord>(&record)) image = frame->image;
    if (std::holds_alternative<EventsRecord>(record)) any_events = true;
  }
  void end(bool) override {}

  Image<std::uint16_t> image;
  bool any_events = false;
};

TEST_F(ColourCamera, ExposesAMosaic) {
  PanoramaRendererOptions panorama;
  panorama.image = folder_.path() / "paint.png";
  scenario_.renderer = panorama;
  scenario_.cameras[0].frame_camera.emplace();
  scenario_.cameras[0].sampling = BrightnessSampling{};
  World world = build_world(scenario_, 2, kSilent);
  LastFrame out;
  simulate(world, out, [](const Progress&) { return true; });
  ASSERT_EQ(out.image.width(), 25);
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 25; ++x)
      ASSERT_EQ(out.image(x, y), std::lround(255 * kLight[static_cast<std::size_t>(x % 2 + y % 2)]));
  }
  EXPECT_FALSE(out.any_events);
}

TEST_F(ColourCamera, IsRefusedByWhatShowsGreyOnly) {
  SpritesRendererOptions sprites;
  sprites.sprites.emplace_back().image = folder_.path() / "paint.png";
  scenario_.renderer = sprites;
  EXPECT_TRUE(test::contains(refusal(), "camera cam0: colour: the renderer sprites renders luminance only"));

  MeshRendererOptions mesh = wall();
  mesh.engine = MeshEngine::gl;
  scenario_.renderer = mesh;
  EXPECT_TRUE(
      test::contains(refusal(), "camera cam0: colour: engine: gl renders luminance only; use engine: processor"));
  mesh.engine = MeshEngine::automatic;
  scenario_.renderer = mesh;
  EXPECT_EQ(refusal(), "nothing was thrown");

  scenario_.cameras[0].sampling = KeyframeSampling{};
  EXPECT_TRUE(test::contains(refusal(), "camera cam0: sampling: keyframes"));
}

}  // namespace
}  // namespace esim
