#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "esim/compose/scene_pictures.h"
#include "esim/studio/glb.h"
#include "esim/studio/page_images.h"

namespace esim::studio {

/// What a renderer shows, as a browser draws it; the renderer itself is made when its first picture is asked for.
class StudioScene {
 public:
  StudioScene(const Scenario& scenario, std::string id, int threads);

  const std::string& id() const { return id_; }

  /// Its textures are coded (see SceneLook).
  const SceneFile& file() const { return file_; }

  /// Of meshes; nothing of others, and where there are more triangles than a browser is asked to draw.
  const std::optional<Glb>& glb() const { return glb_; }

  /// Of panoramas and planes: a JPEG.
  const std::optional<std::string>& texture() const { return texture_; }
  double texture_aspect() const { return texture_aspect_; }  ///< height / width

  std::size_t triangles() const;

  /// One of the GLB's textures, whole; null where there is none of that number. Throws UserError where it cannot be
  /// decoded. From any thread.
  std::shared_ptr<const PageImage> image(std::size_t index);

  /// From here on from any thread. Both throw UserError where the renderer cannot be made.
  bool on_sensor() { return pictures().traits().on_sensor; }
  Image<Rgb> render(const Camera& camera, const RenderRequest& view);  ///< ScenePictures::render

 private:
  ScenePictures& pictures();

  std::string id_;
  Scenario scenario_;
  int threads_;
  SceneFile file_;
  std::mutex mutex_;  // of what follows
  std::optional<ScenePictures> pictures_;
  std::map<std::size_t, std::shared_ptr<const PageImage>> images_;
  std::optional<Glb> glb_;
  std::optional<std::string> texture_;
  double texture_aspect_ = 1;
};

/// The scenes that were looked at last.
class SceneStore {
 public:
  explicit SceneStore(int threads) : threads_(threads) {}

  /// Loads what a scenario shows, unless that has been done and its files have not changed since. Throws UserError
  /// where it cannot be loaded, and for engines, which render in recordings only.
  std::shared_ptr<StudioScene> of(const Scenario& scenario);

  /// Null where it has been forgotten.
  std::shared_ptr<StudioScene> find(const std::string& id);

 private:
  int threads_;
  std::mutex mutex_;
  std::map<std::string, std::shared_ptr<StudioScene>> scenes_;  // by id
  std::vector<std::string> order_;                              // the latest last
};

/// Where the body and what moves are, as the simulator has them.
struct StudioMotion {
  std::shared_ptr<const Trajectory> body;
  TimeSpan simulated;
  std::vector<std::shared_ptr<const Trajectory>> objects;  ///< over the simulated time
  std::vector<std::string> names;                          ///< of the objects
};

StudioMotion motion_of(const Scenario& scenario, const SceneFile& scene);

/// The rig's cameras, as they are simulated; the first is the one by which way points are aimed.
std::vector<CameraInfo> cameras_of(const Scenario& scenario, const SceneFile& scene);

}  // namespace esim::studio
