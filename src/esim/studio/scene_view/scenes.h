#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "esim/compose/scene_pictures.h"
#include "esim/studio/scene_view/glb.h"
#include "esim/studio/scene_view/page_images.h"
#include "esim/studio/scene_view/page_splats.h"

namespace esim::studio {

/// A scene in a format for browsers. Its renderer is made for the first rendered image.
class StudioScene {
 public:
  StudioScene(const Scenario& scenario, std::string id, int threads);

  const std::string& id() const { return id_; }

  /// The scene with coded textures (see SceneLook) and without splats. Its deformations are played from time 0 on.
  const SceneFile& file() const { return file_; }

  /// For meshes, also among splats; empty for other scenes and for too many triangles.
  const std::optional<Glb>& glb() const { return glb_; }

  /// The splats of each object; empty for meshes.
  const std::vector<std::optional<PageSplats>>& splats() const { return splats_; }

  /// A JPEG for panoramas and planes.
  const std::optional<std::string>& texture() const { return texture_; }
  double texture_aspect() const { return texture_aspect_; }  ///< height / width

  /// Light from infinity, with neither its strength nor its rotation; empty without one.
  const std::optional<PageLight>& environment() const { return environment_; }

  std::size_t triangles() const;

  /// A texture of the GLB in full resolution; null if the index is invalid. Throws UserError if it cannot be decoded.
  /// Thread-safe.
  std::shared_ptr<const PageImage> image(std::size_t index);

  // The functions below are thread-safe. They throw UserError if the renderer cannot be made.
  bool on_sensor() { return pictures().traits().on_sensor; }
  Image<Rgb> render(const Camera& camera, const RenderRequest& view);  ///< ScenePictures::render

 private:
  ScenePictures& pictures();

  std::string id_;
  Scenario scenario_;
  int threads_;
  SceneFile file_;
  std::vector<std::optional<PageSplats>> splats_;
  std::mutex mutex_;  // of the members below
  std::optional<ScenePictures> pictures_;
  std::map<std::size_t, std::shared_ptr<const PageImage>> images_;
  std::optional<Glb> glb_;
  std::optional<std::string> texture_;
  double texture_aspect_ = 1;
  std::optional<PageLight> environment_;
};

/// The recently used scenes.
class SceneStore {
 public:
  explicit SceneStore(int threads) : threads_(threads) {}

  /// Loads the scene of a scenario, unless it is loaded and its files are unchanged. Throws UserError if it cannot be
  /// loaded, and for renderers in other programs.
  std::shared_ptr<StudioScene> of(const Scenario& scenario);

  /// Null if it is no longer loaded.
  std::shared_ptr<StudioScene> find(const std::string& id);

 private:
  int threads_;
  std::mutex mutex_;
  std::map<std::string, std::shared_ptr<StudioScene>> scenes_;  // by id
  std::vector<std::string> order_;                              // the latest last
};

/// The motions of the body and of moving objects, as in the simulator.
struct StudioMotion {
  std::shared_ptr<const Trajectory> body;
  TimeSpan simulated;
  std::vector<std::shared_ptr<const Trajectory>> objects;  ///< over the simulated time
  std::vector<std::string> names;                          ///< of the objects
};

StudioMotion motion_of(const Scenario& scenario, const SceneFile& scene);

/// The rig's cameras, as they are simulated; look_at of waypoints refers to the first.
std::vector<CameraInfo> cameras_of(const Scenario& scenario, const SceneFile& scene);

}  // namespace esim::studio
