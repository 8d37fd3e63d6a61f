// Servers that disconnect and come back.
#include <algorithm>
#include <thread>

#include "unrealcv/shown.h"

namespace esim {
namespace {

using test::UnrealcvServer;

/// Whether two samples are identical.
bool same(const Sample& a, const Sample& b) {
  return std::ranges::equal(a.irradiance.pixels(), b.irradiance.pixels()) &&
         std::ranges::equal(a.depth.pixels(), b.depth.pixels()) &&
         std::ranges::equal(a.motion_x.pixels(), b.motion_x.pixels());
}

TEST(UnrealcvReconnection, AsksAgainForWhatIsUnderWay) {
  // It disconnects in the middle of an answer, with three renderings in progress.
  const Camera camera = test::small_camera();
  UnrealcvServer server(test::show_with([](const Camera& model) { return test::make_renderer("mesh", model); }));
  int asked = 0;
  server.tamper = [&asked](const std::string& command, std::string& bytes, bool& hang_up) {
    if (command.find("plane_depth") == std::string::npos || ++asked != 4) return;
    bytes.resize(100);
    hang_up = true;
  };
  const auto renderer = test::renderer_for(test::options_for(server), camera);
  const auto view = [&](double dt) {
    return RenderRequest{test::kTime, test::moving_camera(dt), {{0, 0, camera.width, camera.height}}};
  };
  test::render(*renderer, camera, {});
  const auto first = renderer->start(view(0)), second = renderer->start(view(0.1)), third = renderer->start(view(0.2));
  Sample samples[3], expected;
  second->finish(samples[1]);
  first->finish(samples[0]);
  third->finish(samples[2]);
  EXPECT_EQ(server.connections(), 2);
  for (int i = 0; i < 3; ++i) {
    renderer->render(view(0.1 * i), expected);
    EXPECT_TRUE(same(samples[i], expected)) << i;
  }
  const std::vector<std::string> commands = server.commands();
  EXPECT_EQ(std::count(commands.begin(), commands.end(), "vrun r.setres 32x24"), 2) << "settings are sent again";
}

TEST(UnrealcvReconnection, WaitsForAServerThatIsStartedAgain) {
  const Camera camera = test::small_camera();
  std::optional<UnrealcvServer> server;
  server.emplace(test::show_ramp);
  const int port = server->port();
  const auto renderer = test::renderer_for(test::options_for(*server), camera);
  const Sample before = test::render(*renderer, camera, test::moving_camera());
  server.reset();
  std::thread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    server.emplace(test::show_ramp, std::vector<std::string>{}, UnrealcvServer::Version{}, port);
  });
  const Sample after = test::render(*renderer, camera, test::moving_camera());
  later.join();
  EXPECT_TRUE(same(before, after));
  EXPECT_TRUE(test::has_command(server->commands(), "vrun r.setres 32x24"));
}

TEST(UnrealcvReconnection, GivesUpInTime) {
  const Camera camera = test::small_camera();
  UnrealcvServer server(test::show_ramp);
  const auto renderer = test::renderer_for(test::options_for(server, 0.3), camera);
  test::render(*renderer, camera, {});
  server.stop();
  const auto start = std::chrono::steady_clock::now();
  const std::string message = test::message_of<EngineError>([&] { test::render(*renderer, camera, {}); });
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), 2.5);
  EXPECT_TRUE(test::contains(message, "127.0.0.1:" + std::to_string(server.port()) + ": the connection was lost"));
  EXPECT_TRUE(test::contains(message, "could not be restored within 0.3 s"));
}

TEST(UnrealcvReconnection, GivesUpOnOneThatFallsOverEachTime) {
  const Camera camera = test::small_camera();
  UnrealcvServer server(test::show_ramp);
  UnrealcvOptions options = test::options_for(server, 0.3);
  options.light = EngineLight::npy, options.depth = EngineDepth::plane_depth;
  server.tamper = [](const std::string& command, std::string& bytes, bool& hang_up) {
    if (command.find("lit") != std::string::npos) bytes.clear(), hang_up = true;
  };
  const auto renderer = test::renderer_for(options, camera);
  EXPECT_TRUE(test::contains(test::message_of<EngineError>([&] { test::render(*renderer, camera, {}); }),
                             "the connection was lost"));
  EXPECT_GE(server.connections(), 2);
}

TEST(UnrealcvReconnection, GivesUpOnOneThatFallsOverBehindLightThatCannotBeUsed) {
  // Light is decoded while depth is received: an error of the light must not hide the lost connection.
  const Camera camera = test::small_camera();
  UnrealcvServer server(test::show_ramp);
  UnrealcvOptions options = test::options_for(server, 0.3);
  options.light = EngineLight::npy, options.depth = EngineDepth::plane_depth;
  const Image<float> old(640, 480, 1.0F);
  server.tamper = [&](const std::string& command, std::string& bytes, bool& hang_up) {
    if (command.find("plane_depth") != std::string::npos) bytes.clear(), hang_up = true;
    if (command.find("lit npy") == std::string::npos) return;
    const std::string payload = bytes.substr(8);
    bytes = UnrealcvServer::framed(payload.substr(0, payload.find(':') + 1) + UnrealcvServer::npy("<f4", old));
  };
  const auto renderer = test::renderer_for(options, camera);
  EXPECT_TRUE(test::contains(test::message_of<EngineError>([&] { test::render(*renderer, camera, {}); }),
                             "the connection was lost"));
  EXPECT_GE(server.connections(), 2);
}

TEST(UnrealcvReconnection, WhatIsNotWantedIsForgotten) {
  const Camera camera = test::small_camera();
  UnrealcvServer server(test::show_ramp);
  const auto renderer = test::renderer_for(test::options_for(server), camera);
  const Sample expected = test::render(*renderer, camera, {});
  for (int i = 0; i < 20; ++i) renderer->start({0, {}, {{0, 0, camera.width, camera.height}}}).reset();
  EXPECT_TRUE(same(test::render(*renderer, camera, {}), expected));
}

TEST(UnrealcvReconnection, WaitsForTheWindowToChange) {
  // The first images have the window's old size.
  const Camera camera = test::small_camera();
  UnrealcvServer server(test::show_ramp);
  int asked = 0;
  const Image<float> old(640, 480, 1.0F);
  server.tamper = [&](const std::string& command, std::string& bytes, bool&) {
    if (command.find("lit npy") == std::string::npos || ++asked > 4) return;
    const std::string payload = bytes.substr(8);
    bytes = UnrealcvServer::framed(payload.substr(0, payload.find(':') + 1) + UnrealcvServer::npy("<f4", old));
  };
  const auto renderer = test::renderer_for(test::options_for(server), camera);
  const Sample sample = test::render(*renderer, camera, {});
  EXPECT_EQ(sample.irradiance.width(), 32);
  EXPECT_EQ(asked, 5) << "once to determine whether such images exist";
}

}  // namespace
}  // namespace esim
