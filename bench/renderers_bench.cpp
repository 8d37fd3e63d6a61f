// Cost of a full frame (E, Z and V) of every renderer, 346 x 260. Argument: threads.
#include <benchmark/benchmark.h>

#include <cstdlib>
#include <filesystem>

#include "render/scenes.h"

namespace esim {
namespace {

const Camera kCamera = Camera::from_fov(346, 260, 75.0 * std::numbers::pi / 180.0);

void render_frames(benchmark::State& state, Renderer& renderer, const Kinematics& start) {
  Kinematics camera = start;
  Sample sample;
  for (auto _ : state) {
    camera.T_world_body.translation.y() += 1e-4;
    renderer.render({0, camera, {{0, 0, kCamera.width, kCamera.height}}}, sample);
    benchmark::DoNotOptimize(sample.irradiance.data());
  }
  const double pixels = static_cast<double>(state.iterations()) * kCamera.width * kCamera.height;
  state.counters["ns/px"] =
      benchmark::Counter(pixels * 1e-9, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void panorama(benchmark::State& state) {
  const Workers workers(static_cast<int>(state.range(0)));
  render_frames(state, *test::make_renderer("panorama", kCamera, workers), test::moving_camera());
}

void plane(benchmark::State& state) {
  const Workers workers(static_cast<int>(state.range(0)));
  render_frames(state, *test::make_renderer("plane", kCamera, workers), test::moving_camera());
}

void mesh_file(benchmark::State& state, const std::filesystem::path& file, const Eigen::Vector3d& position) {
  if (!std::filesystem::exists(file)) return state.SkipWithError("the scene is not there");
  const Workers workers(static_cast<int>(state.range(0)));
  const auto scene = build_raycast_scene(still_scene(load_mesh(file, [](const std::string&) {})));
  Kinematics camera = test::moving_camera();
  camera.T_world_body.translation = position;
  render_frames(state, *make_raycast_renderer(scene, {}, kCamera, workers), camera);
}

void room(benchmark::State& state) {
  mesh_file(state, std::filesystem::path(ESIM_SCENES) / "room/room.obj", {-1.0, 0.0, 1.4});
}

void flying_room(benchmark::State& state) {
  const char* data = std::getenv("ESIM_TEST_DATA");
  mesh_file(state, std::filesystem::path(data != nullptr ? data : "") / "mesh/flying_room/flying_room.obj",
            {-2.5, 0.0, -0.5});
}

BENCHMARK(panorama)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(plane)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(room)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(flying_room)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace esim
