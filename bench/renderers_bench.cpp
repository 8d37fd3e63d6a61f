// Cost of a full frame (E, Z and V) of every renderer, 346 x 260. Argument: threads.
#include <benchmark/benchmark.h>

#include <cstdlib>
#include <filesystem>
#include <map>

#include "generated_room.h"
#include "render/scenes.h"
#include "render_frames.h"

namespace esim {
namespace {

const Camera kCamera = Camera::from_fov(346, 260, 75.0 * std::numbers::pi / 180.0);

void panorama(benchmark::State& state) {
  const Workers workers(static_cast<int>(state.range(0)));
  bench::render_frames(state, *test::make_renderer("panorama", kCamera, workers), kCamera, test::moving_camera());
}

void plane(benchmark::State& state) {
  const Workers workers(static_cast<int>(state.range(0)));
  bench::render_frames(state, *test::make_renderer("plane", kCamera, workers), kCamera, test::moving_camera());
}

/// The layers of the tests, and ten translucent ones of 100 x 50 pixels in front of them.
void sprites(benchmark::State& state) {
  SpriteScene scene = test::test_sprites();
  const auto light = test::smooth_texture(Wrap::clamp, Wrap::clamp);
  const auto alpha = std::make_shared<const Texture>(Image<float>(1024, 512, 0.7F), Wrap::clamp, Wrap::clamp);
  for (int i = 0; i < 10; ++i) {
    const SpritePose key{0, {32.0 * i - 150, 20.0 * i - 90}, 20.0 * i, {0.1, 0.1}};
    scene.sprites.insert(scene.sprites.begin(), {light, alpha, SpriteUnits::pixel, SpriteBeyond::nothing,
                                                 SpriteMotion({key}, SpriteInterpolation::linear)});
  }
  const Workers workers(static_cast<int>(state.range(0)));
  bench::render_frames(state, *make_sprites_renderer(scene, kCamera, workers), kCamera, test::moving_camera());
}

void mesh_file(benchmark::State& state, const std::filesystem::path& file, const Eigen::Vector3d& position) {
  if (!std::filesystem::exists(file)) return state.SkipWithError("the scene file is missing");
  const Workers workers(static_cast<int>(state.range(0)));
  const auto scene = build_raycast_scene(still_scene(load_mesh(file, [](const std::string&) {})));
  Kinematics camera = test::moving_camera();
  camera.T_world_body.translation = position;
  bench::render_frames(state, *make_raycast_renderer(scene, {}, kCamera, workers), kCamera, camera);
}

void room(benchmark::State& state) {
  mesh_file(state, std::filesystem::path(ESIM_SCENES) / "room/room.obj", {-1.0, 0.0, 1.4});
}

void flying_room(benchmark::State& state) {
  const char* data = std::getenv("ESIM_TEST_DATA");
  mesh_file(state, std::filesystem::path(data != nullptr ? data : "") / "mesh/flying_room/flying_room.obj",
            {-2.5, 0.0, -0.5});
}

/// Arguments: threads, how many boxes move before the camera.
void moving_objects(benchmark::State& state) {
  const Workers workers(static_cast<int>(state.range(0)));
  Scene scene = test::moving_scene();
  scene.objects.resize(static_cast<std::size_t>(1 + state.range(1)), scene.objects.back());
  std::vector<Kinematics> objects = test::moving_objects(0);
  objects.resize(static_cast<std::size_t>(state.range(1)), objects[0]);
  for (std::size_t i = 2; i < objects.size(); ++i)
    objects[i].T_world_body.translation.z() += 0.1 * static_cast<double>(i);
  const auto renderer = make_raycast_renderer(build_raycast_scene(scene), {}, kCamera, workers);
  bench::render_frames(state, *renderer, kCamera, test::moving_camera(), 1, objects);
}

/// Arguments: threads, triangles in thousands, tiles (every how manieth of 32 x 20 pixels).
void generated_room(benchmark::State& state) {
  const Workers workers(static_cast<int>(state.range(0)));
  static std::map<std::int64_t, std::shared_ptr<const RaycastScene>> scenes;  // built once each
  auto& scene = scenes[state.range(1)];
  if (scene == nullptr)
    scene = build_raycast_scene(still_scene(bench::generated_room(static_cast<int>(1000 * state.range(1)))));
  const auto renderer = make_raycast_renderer(scene, {}, kCamera, workers);
  bench::render_frames(state, *renderer, kCamera, test::moving_camera(), static_cast<int>(state.range(2)));
}

/// The same with OpenGL on the default device. Arguments: triangles in thousands, tiles.
void generated_room_gl(benchmark::State& state) {
  if (!test::has_gl()) return state.SkipWithError("OpenGL is not available");
  const Scene scene = still_scene(bench::generated_room(static_cast<int>(1000 * state.range(0))));
  const auto renderer = make_gl_renderer(scene, {}, kCamera);
  state.SetLabel(renderer->traits().device);
  bench::render_frames(state, *renderer, kCamera, test::moving_camera(), static_cast<int>(state.range(1)));
}

/// With light and shadows; argument: what casts them, 0 nothing, 1 a sun, 2 a lamp, 3 a sun on things that move.
void shadows_gl(benchmark::State& state) {
  if (!test::has_gl()) return state.SkipWithError("OpenGL is not available");
  const bool moves = state.range(0) == 3;
  Scene scene = moves ? test::moving_scene() : still_scene(bench::generated_room(10000));
  scene.lighting = Lighting{};
  scene.lighting->shadows = state.range(0) > 0;
  if (state.range(0) == 2) {
    scene.lighting->points.push_back({{0.5F, 0.5F, 0.5F}, 1});
  } else {
    scene.lighting->suns.push_back({{0.3F, 0.2F, -1}, 1});
  }
  const auto renderer = make_gl_renderer(scene, {}, kCamera);
  const auto objects = moves ? test::moving_objects(0) : std::vector<Kinematics>();
  bench::render_frames(state, *renderer, kCamera, test::moving_camera(), 1, objects);
}

BENCHMARK(panorama)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(plane)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(sprites)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(room)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(flying_room)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);

BENCHMARK(moving_objects)
    ->ArgNames({"threads", "objects"})
    ->ArgsProduct({{1, 2}, {0, 1, 10}})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK(generated_room)
    ->ArgNames({"threads", "thousands", "nth_tile"})
    ->ArgsProduct({{1, 2}, {10, 127, 1000}, {1}})
    ->Args({1, 127, 10})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

BENCHMARK(generated_room_gl)
    ->ArgNames({"thousands", "nth_tile"})
    ->ArgsProduct({{10, 127, 1000}, {1}})
    ->Args({127, 10})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK(shadows_gl)->DenseRange(0, 3)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace esim
