// Clients with servers of several versions.
#include "unrealcv/shown.h"

namespace esim {
namespace {

using test::UnrealcvServer;

struct VersionCase {
  const char* name;
  UnrealcvServer::Version version;
  double light_step;  // of the irradiance
};

std::vector<VersionCase> versions() {
  std::vector<VersionCase> cases;
  cases.push_back({"with everything", {}, 1e-6});
  cases.push_back({"0.3.10", {.npy_light = false, .npy_mask = false}, 5e-3});
  cases.push_back({"without pose and plane_depth", {.pose = false, .plane_depth = false, .npy_light = false}, 5e-3});
  cases.push_back(
      {"newest",
       {.pose = false, .plane_depth = false, .npy_light = false, .horizontal_fieldofview = false, .size = true},
       5e-3});
  return cases;
}

TEST(UnrealcvVersions, AllShowTheSame) {
  const Camera camera = test::small_camera();
  const PinholeImage expected = test::show_ramp({camera.width, camera.height});
  for (const VersionCase& v : versions()) {
    for (const bool pipelined : {true, false}) {
      UnrealcvServer server(test::show_ramp, {}, v.version);
      UnrealcvOptions options = test::options_for(server);
      options.pipelined = pipelined;
      const auto renderer = test::renderer_for(options, camera);
      const Sample sample = test::render(*renderer, camera, test::moving_camera());
      double worst_light = 0, worst_depth = 0;
      for (std::size_t i = 0; i < sample.irradiance.size(); ++i) {
        const auto difference = [i](const Image<float>& a, const Image<float>& b) {
          return std::fabs(double{a.data()[i]} - double{b.data()[i]});
        };
        worst_light = std::max(worst_light, difference(sample.irradiance, expected.irradiance));
        worst_depth = std::max(worst_depth, difference(sample.depth, expected.depth));
      }
      EXPECT_LT(worst_light, v.light_step) << v.name;
      EXPECT_LT(worst_depth, 2e-6) << v.name;
    }
  }
}

TEST(UnrealcvVersions, TheCommandsOfAFrame) {
  const Camera camera = test::small_camera();
  UnrealcvServer server(test::show_ramp);
  const auto renderer = test::renderer_for(test::options_for(server), camera);
  Kinematics at;
  at.T_world_body = camera_pose_of({{100, 200, -50}, 10, 20, -30});
  test::render(*renderer, camera, at);
  const std::size_t before = server.commands().size();
  at.T_world_body = camera_pose_of({{101, 200, -50}, 10, 20, -30});
  test::render(*renderer, camera, at);
  std::vector<std::string> commands = server.commands();
  EXPECT_TRUE(test::has_command(commands, "vrun r.setres 32x24"));
  EXPECT_TRUE(test::has_command(commands, "vset /camera/0/horizontal_fieldofview 68.75493542"));
  commands.erase(commands.begin(), commands.begin() + static_cast<std::ptrdiff_t>(before));
  EXPECT_EQ(commands, (std::vector<std::string>{
                          "vset /camera/0/pose 101.000000 200.000000 -50.000000 10.00000000 20.00000000 -30.00000000",
                          "vget /camera/0/lit npy", "vget /camera/0/plane_depth npy"}))
      << "size and field of view are the same as before";
}

TEST(UnrealcvVersions, WhatIsForcedIsAskedForAsItIs) {
  const Camera camera = test::small_camera();
  UnrealcvServer server(test::show_ramp);
  UnrealcvOptions options = test::options_for(server);
  options.light = EngineLight::png;
  options.depth = EngineDepth::ray_metres;
  options.exposure = 2;
  options.lag_frames = 2;
  const Sample sample = test::render(*test::renderer_for(options, camera), camera, {});
  const std::vector<std::string> commands = server.commands();
  EXPECT_FALSE(test::has_command(commands, "vget /camera/0/lit npy"));
  EXPECT_FALSE(test::has_command(commands, "vget /camera/0/plane_depth npy"));
  EXPECT_EQ(std::count(commands.begin(), commands.end(), "vget /camera/0/lit png"), 3) << "two are discarded";
  EXPECT_NEAR(sample.irradiance(0, 0), 0.2, 5e-3);
  EXPECT_NEAR(sample.depth(0, 0), 2, 1e-5);
}

TEST(UnrealcvVersions, ColourBecomesLuminance) {
  const Camera camera = test::small_camera();
  UnrealcvServer server(test::show_ramp);
  const std::size_t pixels = static_cast<std::size_t>(camera.width * camera.height);
  std::vector<float> colours;
  std::vector<unsigned char> codes;
  for (std::size_t i = 0; i < pixels; ++i) {
    colours.insert(colours.end(), {1.5F, 0.5F, 0.25F, 0});
    codes.insert(codes.end(), {255, 0, 0, 0});
  }
  const auto light = [&] {
    return test::render(*test::renderer_for(test::options_for(server), camera), camera, {}).irradiance(5, 5);
  };
  server.ready["lit npy"] = UnrealcvServer::npy("<f4", "24, 32, 4", colours.data(), 4 * colours.size());
  EXPECT_NEAR(light(), 0.2126 * 1.5 + 0.7152 * 0.5 + 0.0722 * 0.25, 1e-6) << "linear, above 1, for any alpha";
}

TEST(UnrealcvVersions, BytesAreSrgb) {
  const Camera camera = test::small_camera();
  UnrealcvServer server(test::show_ramp);
  std::vector<unsigned char> codes;
  for (int i = 0; i < camera.width * camera.height; ++i) codes.insert(codes.end(), {188, 188, 188, 0});
  server.ready["lit npy"] = UnrealcvServer::npy("|u1", "24, 32, 4", codes.data(), codes.size());
  const Sample sample = test::render(*test::renderer_for(test::options_for(server), camera), camera, {});
  EXPECT_NEAR(sample.irradiance(5, 5), 0.5029, 1e-3);
}

TEST(UnrealcvVersions, TheSkyIsInfinitelyFar) {
  const Camera camera = test::small_camera();
  UnrealcvServer server([](const test::ServedView& view) {
    PinholeImage image = test::show_ramp(view);
    image.depth(1, 0) = 65504;
    image.depth(2, 0) = std::numeric_limits<float>::infinity();
    image.depth(3, 0) = 0;
    return image;
  });
  const Sample sample = test::render(*test::renderer_for(test::options_for(server), camera), camera, {});
  EXPECT_TRUE(std::isfinite(sample.depth(0, 0)));
  for (const int x : {1, 2, 3}) EXPECT_TRUE(std::isinf(sample.depth(x, 0))) << x;
}

}  // namespace
}  // namespace esim
