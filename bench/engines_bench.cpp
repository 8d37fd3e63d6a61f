// The engines of the processor, on all of it, and OpenGL, on the same scenes from the same places: one full frame (E, Z
// and V). Meshes, by the ray caster and the rasteriser, have 16 samples per pixel as in the shipped scenarios; splats
// are those of the room. Names: SCENE/WIDTHxHEIGHT/ENGINE. The label of gl is its device. compare_engines.py makes
// tables of it.
#include <benchmark/benchmark.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "esim/scene/splats/splat_file.h"
#include "generated_room.h"
#include "render/scenes.h"
#include "render_frames.h"

namespace esim {
namespace {

constexpr int kSamplesPerPixel = 16;

struct View {
  std::string name;
  std::function<Mesh()> load;
  SE3 T_world_camera;
};

SE3 pose(const Eigen::Vector3d& position, const Eigen::Quaterniond& rotation) {
  SE3 pose;
  pose.translation = position;
  pose.rotation = rotation.normalized();
  return pose;
}

Mesh shipped(const std::string& file) {
  return load_mesh(std::filesystem::path(ESIM_SCENES) / file, [](const std::string&) {});
}

/// Where scenes/room.yaml and scenes/splats.yaml start.
const SE3 kRoomStart = pose({2.016, -1.649, 1.511}, {0.61495, -0.68379, -0.28614, 0.26905});

/// The shipped rooms from where their scenarios start, and generated ones of many triangles.
std::vector<View> views() {
  const SE3 middle = test::moving_camera().T_world_body;
  return {
      {"room", [] { return shipped("room/room.obj"); }, kRoomStart},
      {"studio_room", [] { return shipped("studio_room/baked.glb"); },
       pose({1.557, -1.991, 1.509}, {-0.63155, 0.73724, 0.17634, -0.16289})},
      {"generated_127k", [] { return bench::generated_room(127000); }, middle},
      {"generated_1000k", [] { return bench::generated_room(1000000); }, middle},
  };
}

Kinematics motion_from(const SE3& T_world_camera) {
  Kinematics camera = test::moving_camera();
  camera.T_world_body = T_world_camera;
  return camera;
}

/// The scene of the last benchmark, since Google Benchmark calls each of them several times; one of them, since some
/// are large. No renderer: a driver may be gone already where static variables end.
struct Prepared {
  std::string name;
  Scene scene;
  std::shared_ptr<const RaycastScene> raycast;  // null until the ray caster asks for it
  std::shared_ptr<const RaycastScene> raster;   // null until the rasteriser asks for it
};

Prepared& prepared(const View& view) {
  static Prepared last;
  if (last.name != view.name) {
    last = {};  // frees its memory first
    last = {view.name, still_scene(view.load()), nullptr, nullptr};
  }
  return last;
}

/// An engine of the processor, on all of it. `built` is its scene of the last view.
template <typename Options, typename Build, typename Make>
void on_processor(benchmark::State& state, const View& view, const Camera& camera,
                  std::shared_ptr<const RaycastScene> Prepared::*built, const Build& build, const Make& make) {
  const Workers workers(static_cast<int>(std::thread::hardware_concurrency()));
  Prepared& room = prepared(view);
  if (room.*built == nullptr) room.*built = build(room.scene);
  const auto renderer = make(room.*built, Options{.samples_per_pixel = kSamplesPerPixel}, camera, workers,
                             ColourFilters::none, PixelArea{});
  bench::render_frames(state, *renderer, camera, motion_from(view.T_world_camera));
}

void raycast(benchmark::State& state, const View& view, const Camera& camera) {
  on_processor<RaycastOptions>(state, view, camera, &Prepared::raycast, build_raycast_scene, make_raycast_renderer);
}

void raster(benchmark::State& state, const View& view, const Camera& camera) {
  on_processor<RasterOptions>(state, view, camera, &Prepared::raster, build_raster_scene, make_raster_renderer);
}

void gl(benchmark::State& state, const View& view, const Camera& camera) {
  if (!test::has_gl()) return state.SkipWithError("OpenGL is not available");
  const auto renderer = make_gl_renderer(prepared(view).scene, {.samples_per_pixel = kSamplesPerPixel}, camera);
  state.SetLabel(renderer->traits().device);
  bench::render_frames(state, *renderer, camera, motion_from(view.T_world_camera));
}

std::shared_ptr<const Splats> room_splats() {
  Splats splats = load_splats(std::filesystem::path(ESIM_SCENES) / "splats/room.spz", [](const std::string&) {});
  splats.light = SplatLight::linear;
  splats.filter = SplatFilter::mip;
  return std::make_shared<const Splats>(std::move(splats));
}

void splats_on_processor(benchmark::State& state, const Camera& camera) {
  const Workers workers(static_cast<int>(std::thread::hardware_concurrency()));
  const auto renderer = make_splat_renderer(build_splat_scene({{room_splats()}}), {}, camera, workers);
  bench::render_frames(state, *renderer, camera, motion_from(kRoomStart));
}

void splats_gl(benchmark::State& state, const Camera& camera) {
  if (!test::has_gl()) return state.SkipWithError("OpenGL is not available");
  const auto renderer = make_gl_splat_renderer({{room_splats()}}, {}, camera, std::nullopt);
  state.SetLabel(renderer->traits().device);
  bench::render_frames(state, *renderer, camera, motion_from(kRoomStart));
}

/// SCENE/WIDTHxHEIGHT/ENGINE, of `run(state, camera)`.
template <typename Run>
void add(const std::string& scene, const std::string& engine, const Camera& camera, const Run& run) {
  const std::string name =
      scene + "/" + std::to_string(camera.width) + "x" + std::to_string(camera.height) + "/" + engine;
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) { run(state, camera); })
      ->UseRealTime()
      ->Unit(benchmark::kMillisecond);
}

/// All sizes of a scene, one engine after the other.
template <typename AddEngines>
void add_sizes(const AddEngines& add_engines) {
  for (const auto& [width, height] : {std::pair{346, 260}, std::pair{1280, 720}})
    add_engines(Camera::from_fov(width, height, 75.0 * std::numbers::pi / 180.0));
}

const bool kRegistered = [] {
  for (const View& view : views()) {
    add_sizes([&](const Camera& camera) {
      for (const auto& [engine, run] :
           {std::pair{"raycast", &raycast}, std::pair{"raster", &raster}, std::pair{"gl", &gl}})
        add(view.name, engine, camera, [=, run = run](auto& state, const Camera& model) { run(state, view, model); });
    });
  }
  add_sizes([](const Camera& camera) {
    add("room_splats", "processor", camera, splats_on_processor);
    add("room_splats", "gl", camera, splats_gl);
  });
  return true;
}();

}  // namespace
}  // namespace esim
