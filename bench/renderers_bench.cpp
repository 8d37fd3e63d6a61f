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

/// How pixels average: the argument `engine` of the benchmarks of meshes.
enum Engine : std::int64_t { kOneRay, kRaysAtEdges, kRaster };

/// Renderers of a mesh, whose scenes are built once each.
class MeshRenderers {
 public:
  explicit MeshRenderers(Mesh mesh) : scene_(still_scene(std::move(mesh))) {}

  std::unique_ptr<Renderer> make(std::int64_t engine, const Workers& workers) {
    if (engine == kRaster) {
      if (raster_ == nullptr) raster_ = build_raster_scene(scene_);
      return make_raster_renderer(raster_, {}, kCamera, workers);
    }
    if (raycast_ == nullptr) raycast_ = build_raycast_scene(scene_);
    return make_raycast_renderer(raycast_, {.samples_per_pixel = engine == kOneRay ? 1 : 16}, kCamera, workers);
  }

 private:
  Scene scene_;
  std::shared_ptr<const RaycastScene> raycast_, raster_;
};

void mesh_file(benchmark::State& state, const std::filesystem::path& file, const Eigen::Vector3d& position) {
  if (!std::filesystem::exists(file)) return state.SkipWithError("the scene file is missing");
  const Workers workers(static_cast<int>(state.range(0)));
  MeshRenderers renderers(load_mesh(file, [](const std::string&) {}));
  Kinematics camera = test::moving_camera();
  camera.T_world_body.translation = position;
  bench::render_frames(state, *renderers.make(state.range(1), workers), kCamera, camera);
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

/// Arguments: threads, engine, triangles in thousands, tiles (every how manieth of 32 x 20 pixels).
void generated_room(benchmark::State& state) {
  const Workers workers(static_cast<int>(state.range(0)));
  static std::map<std::int64_t, MeshRenderers> rooms;
  const std::int64_t thousands = state.range(2);
  if (!rooms.contains(thousands))
    rooms.emplace(thousands, MeshRenderers(bench::generated_room(static_cast<int>(1000 * thousands))));
  const auto renderer = rooms.at(thousands).make(state.range(1), workers);
  bench::render_frames(state, *renderer, kCamera, test::moving_camera(), static_cast<int>(state.range(3)));
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
void threads_and_engines(benchmark::internal::Benchmark* benchmark) {
  benchmark->ArgNames({"threads", "engine"})->ArgsProduct({{1, 2}, {kOneRay, kRaysAtEdges, kRaster}});
  benchmark->UseRealTime()->Unit(benchmark::kMillisecond);
}
BENCHMARK(room)->Apply(threads_and_engines);
BENCHMARK(flying_room)->Apply(threads_and_engines);

BENCHMARK(moving_objects)
    ->ArgNames({"threads", "objects"})
    ->ArgsProduct({{1, 2}, {0, 1, 10}})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK(generated_room)
    ->ArgNames({"threads", "engine", "thousands", "nth_tile"})
    ->ArgsProduct({{1, 2}, {kOneRay, kRaysAtEdges, kRaster}, {10, 127, 1000}, {1}})
    ->ArgsProduct({{1}, {kOneRay, kRaysAtEdges, kRaster}, {127}, {10}})
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
