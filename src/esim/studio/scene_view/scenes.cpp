#include "esim/studio/scene_view/scenes.h"

#include <fmt/format.h>

#include <algorithm>

#include "esim/core/error.h"
#include "esim/scenario/read.h"
#include "esim/scenario/schema.h"
#include "esim/scene/environment/environment.h"
#include "esim/scene/images/image_file.h"

namespace esim::studio {
namespace {

const Notices kSilent{[](const std::string&) {}, [](const std::string&) {}};

constexpr std::size_t kMaxScenes = 3;
constexpr int kLongestPicture = 4096, kLongestEnvironment = 1024;
constexpr int kFiner = 2;  // even: see ScenePictures::render()

std::string stamp_of(const std::filesystem::path& file) {
  std::error_code error;
  const auto time = std::filesystem::last_write_time(file, error);
  const auto bytes = std::filesystem::file_size(file, error);
  return fmt::format("{}:{}:{};", file.string(), time.time_since_epoch().count(), error ? 0 : bytes);
}

/// A visitor of describe() that stamps the files of a renderer's scene, and removes the motions of its objects.
class SceneFiles {
 public:
  template <typename T>
  void operator()(const char*, T& value, const About&) {
    look_at(value);
  }

  const std::string& stamps() const { return stamps_; }

 private:
  void look_at(std::filesystem::path& file) {
    if (!file.empty()) stamps_ += stamp_of(file);
  }
  void look_at(VertexFile& vertices) {
    for (std::filesystem::path& file : files_if_complete(vertices)) look_at(file);
  }
  void look_at(TrajectoryOptions& motion) { motion = StaticTrajectoryOptions{}; }
  template <typename T>
  void look_at(std::vector<T>& values) {
    for (T& value : values) look_at(value);
  }
  template <typename T>
  void look_at(std::optional<T>& value) {
    if (value) look_at(*value);
  }
  template <typename T>
  void look_at(T& value) {
    if constexpr (requires { describe(*this, value); }) describe(*this, value);
  }

  std::string stamps_;
};

/// A text that identifies a loaded scene: the renderer without the motions of its objects, and the state of the files.
std::string key_of(const RendererOptions& renderer) {
  Scenario bare;
  bare.renderer = renderer;
  SceneFiles files;
  std::visit([&](auto& options) { describe(files, options); }, bare.renderer);
  return files.stamps() + write_scenario(bare);
}

/// Whether making the renderer may fail for a reason other than an unreadable scene.
bool fails_when_made(const RendererOptions& renderer, const Scene& scene) {
  if (const auto* const mesh = std::get_if<MeshRendererOptions>(&renderer)) return mesh->engine == MeshEngine::gl;
  if (!std::holds_alternative<SplatsRendererOptions>(renderer)) return true;
  const Splats* first = nullptr;  // splats in linear light and in display colours cannot be blended
  for (const SceneObject& object : scene.objects) {
    if (!object.splats) continue;
    if (first != nullptr && first->light != object.splats->light) return true;
    first = object.splats.get();
  }
  return false;
}

/// Null without one.
const EnvironmentOptions* environment_of(const RendererOptions& renderer) {
  return std::visit(
      [](const auto& options) -> const EnvironmentOptions* {
        if constexpr (requires { options.lighting; }) {
          const auto* const pbr = std::get_if<PbrOptions>(&options.lighting);
          if (pbr != nullptr && pbr->environment) return &*pbr->environment;
        }
        return nullptr;
      },
      renderer);
}

void refuse_engines(const Scenario& scenario) {
  if (engine_objects(scenario.renderer) != nullptr)
    throw UserError(
        "renderer: another program renders this scene, so that it cannot be shown here; look at a recording of it");
}

}  // namespace

StudioScene::StudioScene(const Scenario& scenario, std::string id, int threads)
    : id_(std::move(id)),
      scenario_(scenario),
      threads_(threads),
      file_(load_scenes(scenario, SceneLook::coded, kSilent)) {
  play_deformations(scenario, 0, file_);
  if (fails_when_made(scenario.renderer, file_.scene)) pictures();
  splats_ = page_splats(file_.scene);
  for (SceneObject& object : file_.scene.objects) object.splats = nullptr;  // they may take gigabytes
  if (const EnvironmentOptions* const environment = environment_of(scenario.renderer))
    environment_ = page_light(load_environment_image(environment->image, true), kLongestEnvironment);
  const bool mesh = std::holds_alternative<MeshRendererOptions>(scenario.renderer);
  if (mesh || triangles() > 0) {
    if (triangles() <= kMaxTriangles) glb_ = make_glb(file_.scene, Workers(threads));
    return;
  }
  const auto show = [&](const std::filesystem::path& image, const Softening& softening) {
    const Planes planes = load_colours(image, softening);
    texture_ = make_jpeg(planes, kLongestPicture);
    texture_aspect_ = static_cast<double>(planes.front().height()) / planes.front().width();
  };
  if (const auto* panorama = std::get_if<PanoramaRendererOptions>(&scenario.renderer))
    show(panorama->image, {panorama->median_px, panorama->gaussian_px, true});
  if (const auto* plane = std::get_if<PlaneRendererOptions>(&scenario.renderer))
    show(plane->image, {plane->median_px, plane->gaussian_px});
}

std::size_t StudioScene::triangles() const {
  std::size_t count = 0;
  for (const SceneObject& object : file().scene.objects) count += object.mesh.triangles.size();
  return count;
}

std::shared_ptr<const PageImage> StudioScene::image(std::size_t index) {
  if (!glb_ || index >= glb_->images.size()) return nullptr;
  {
    const std::lock_guard lock(mutex_);
    if (const auto known = images_.find(index); known != images_.end()) return known->second;
  }
  auto made = std::make_shared<const PageImage>(page_image(*glb_->images[index]));
  const std::lock_guard lock(mutex_);
  return images_.try_emplace(index, std::move(made)).first->second;
}

ScenePictures& StudioScene::pictures() {
  const std::lock_guard lock(mutex_);
  if (!pictures_) pictures_.emplace(scenario_, threads_, kSilent);
  return *pictures_;
}

Image<Rgb> StudioScene::render(const Camera& camera, const RenderRequest& view) {
  ScenePictures& pictures = this->pictures();
  const std::lock_guard lock(mutex_);
  return pictures.render(camera, pictures.traits().on_sensor ? 1 : kFiner, view);
}

std::shared_ptr<StudioScene> SceneStore::of(const Scenario& scenario) {
  refuse_engines(scenario);
  const std::string id = fmt::format("{:016x}", std::hash<std::string>()(key_of(scenario.renderer)));
  const std::lock_guard lock(mutex_);  // other requests for the same scene wait
  const auto known = scenes_.find(id);
  if (known != scenes_.end()) return known->second;
  auto scene = std::make_shared<StudioScene>(scenario, id, threads_);
  scenes_[id] = scene;
  order_.push_back(id);
  if (order_.size() > kMaxScenes) {
    scenes_.erase(order_.front());
    order_.erase(order_.begin());
  }
  return scene;
}

std::shared_ptr<StudioScene> SceneStore::find(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto known = scenes_.find(id);
  return known == scenes_.end() ? nullptr : known->second;
}

StudioMotion motion_of(const Scenario& scenario, const SceneFile& scene) {
  StudioMotion motion;
  motion.body = build_trajectory(scenario, scene, kSilent);
  motion.simulated = simulated_span(scenario, *motion.body);
  motion.objects = build_object_trajectories(scenario, scene, *motion.body, motion.simulated, kSilent);
  for (const SceneObject& object : scene.scene.objects) {
    if (object.moves) motion.names.push_back(object.name);
  }
  if (const auto* const objects = engine_objects(scenario.renderer)) {
    for (const EngineObjectOptions& object : *objects) motion.names.push_back(object.name);
  }
  return motion;
}

std::vector<CameraInfo> cameras_of(const Scenario& scenario, const SceneFile& scene) {
  const SceneCamera* followed = nullptr;
  try {
    followed = followed_camera(scenario, scene);
  } catch (const UserError&) {  // reported with the motion
  }
  std::vector<CameraInfo> cameras;
  for (const CameraOptions& options : scenario.cameras) cameras.push_back(camera_info(options, followed));
  return cameras;
}

}  // namespace esim::studio
