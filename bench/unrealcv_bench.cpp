// The cost of UnrealCV's protocol without the engine's own time: from the request to E, Z and V, for frames of 346 x
// 260 that a server in this process has ready. Argument: light as PNG.
#include <benchmark/benchmark.h>

#include <string>

#include "unrealcv/ready_server.h"

namespace esim {
namespace {

void frames(benchmark::State& state, const Camera& camera) {
  const bool png = state.range(0) != 0;
  const auto server = test::ready_server(camera, png);
  const PinholeView view = pinhole_view(camera, PixelRays(camera), Pinhole::centred);
  state.SetLabel(std::to_string(view.width) + " x " + std::to_string(view.height) + " px are sent");
  const auto renderer = test::renderer_for(test::options_for(*server), camera);
  Kinematics at = test::moving_camera();
  Sample sample;
  const std::vector<Tile> whole = {{0, 0, camera.width, camera.height}};
  renderer->render({0, at, whole}, sample);  // connects
  for (auto _ : state) {
    at.T_world_body.translation.y() += 1e-4;
    renderer->render({0, at, whole}, sample);
    benchmark::DoNotOptimize(sample.motion_x.data());
  }
}

void pinhole(benchmark::State& state) { frames(state, Camera::from_fov(346, 260, 1.3)); }

/// Looked up in a wider image, which is larger as well.
void lens(benchmark::State& state) {
  Camera camera = Camera::from_fov(346, 260, 1.3);
  camera.distortion = RadialTangential{-0.3829, 0.1893, -0.001, -0.00056, 0.0};
  frames(state, camera);
}

BENCHMARK(pinhole)->ArgName("png")->Arg(0)->Arg(1)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(lens)->ArgName("png")->Arg(0)->Arg(1)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace esim
