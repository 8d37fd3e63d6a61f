// Lens distortion from a pinhole image; the server shows the tests' scenes. The contract: render/renderer_test.cpp.
#include "unrealcv/shown.h"

namespace esim {
namespace {

using test::UnrealcvServer;

/// (whether there are moving objects, type of camera: 0 to 3 distortions, 4 off-centre, 5 a pinhole like the server's)
class UnrealcvRenderer : public testing::TestWithParam<std::tuple<bool, int>> {
 protected:
  static Camera camera_of(int kind) {
    if (kind < 4) return test::distorted_camera(kind);
    Camera camera = Camera::from_fov(120, 90, 1.1);
    if (kind == 4) camera.cx += 7.25, camera.cy -= 3, camera.fy *= 1.03;
    return camera;
  }
  std::string scene() const { return std::get<0>(GetParam()) ? "moving_mesh" : "mesh"; }
  std::vector<std::string> names() const {
    return std::get<0>(GetParam()) ? std::vector<std::string>{"left", "right"} : std::vector<std::string>();
  }
  UnrealcvServer::Show show() const {
    return test::show_with([this](const Camera& model) { return test::make_renderer(scene(), model); }, names());
  }
  RenderRequest view(double dt) const {
    return {test::kTime + to_ns(dt),
            test::moving_camera(dt),
            {{0, 0, model_.width, model_.height}},
            test::objects_of(scene(), dt)};
  }
  std::unique_ptr<Renderer> renderer(UnrealcvServer& server) const {
    UnrealcvOptions options = test::options_for(server, 60);
    options.objects = names();
    return test::renderer_for(options, model_);
  }

  const Camera model_ = camera_of(std::get<1>(GetParam()));
};

TEST_P(UnrealcvRenderer, ShowsWhatTheRayCasterShows) {
  UnrealcvServer server(show(), names());
  const auto under_test = renderer(server), reference = test::make_renderer(scene(), model_);
  Sample sample, expected;
  under_test->render(view(0), sample);
  reference->render(view(0), expected);
  double light = 0, flow = 0;
  std::vector<double> depths;
  int other_object = 0;
  const auto count = static_cast<double>(sample.depth.size());
  for (std::size_t i = 0; i < sample.depth.size(); ++i) {
    light += std::fabs(sample.irradiance.data()[i] - expected.irradiance.data()[i]) / count;
    depths.push_back(std::fabs(sample.depth.data()[i] / expected.depth.data()[i] - 1));
    flow += std::fabs(sample.motion_x.data()[i] - expected.motion_x.data()[i]) / count;
    if (!names().empty()) other_object += sample.object.data()[i] != expected.object.data()[i];
  }
  std::sort(depths.begin(), depths.end());
  const bool looked_up = std::get<1>(GetParam()) != 5;
  EXPECT_LT(light, 0.01);
  EXPECT_LT(depths[depths.size() * 9 / 10], 1e-3);
  EXPECT_LT(flow, looked_up ? 1.0 : 0.05) << "px/s; the camera moves by hundreds, and edges are other objects'";
  EXPECT_LE(other_object, looked_up ? count / 50 : count / 500) << "on edges";
  EXPECT_EQ(sample.object.empty(), names().empty());
}

INSTANTIATE_TEST_SUITE_P(Cameras, UnrealcvRenderer, testing::Combine(testing::Bool(), testing::Range(0, 6)));

}  // namespace
}  // namespace esim
