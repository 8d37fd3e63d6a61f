#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "esim/core/time.h"
#include "esim/geometry/se3.h"
#include "esim/scene/scene.h"

namespace esim::inline scene {

/// A pose in a scene file at a time of the file's animation.
struct ScenePose {
  TimeNs t = 0;
  SE3 T_world_object;
};

/// A motion in a scene file: poses in order of time, close enough for a smooth curve through them. All motions of a
/// file span its complete animation. A single pose means no motion.
using SceneMotion = std::vector<ScenePose>;

struct SceneCamera {
  std::string name;
  std::optional<double> horizontal_fov_rad;
  SceneMotion motion;  ///< of the camera frame: x right, y down, z forward
};

/// The content of a scene file. The world's z axis points up; docs/scenes.md has each format's frame and units.
struct SceneFile {
  Scene scene;                       ///< first the static part, if there is one; then what moves or deforms
  std::vector<SceneMotion> motions;  ///< of the scene's moving objects, in their order
  std::vector<SceneCamera> cameras;
  TimeSpan animation;           ///< of the file; empty if nothing moves
  std::size_t image_count = 0;  ///< number of images that were read
};

/// Reads a scene: OBJ with MTL, PLY, STL, glTF 2.0 (.gltf, .glb), FBX, Collada (.dae). Textures are read from the
/// scene's own folder and below. If one is missing, elsewhere or unreadable, there is a warning, and its surfaces are
/// grey. Throws UserError, naming the file, if it cannot be read, is damaged, or has no triangles.
SceneFile load_scene_file(const std::filesystem::path& path, const WarningHandler& warn,
                          SceneLook look = SceneLook::luminance, SurfaceModel model = SurfaceModel::matte);

/// Loads a scene file as one object in the file's coordinates, with the name of the file. If anything in it is
/// animated, the object deforms: all animations are played, or those with the name `animation`. Throws as
/// load_scene_file(), and if a file has no animation of that name.
SceneObject load_scene_object(const std::filesystem::path& path, const WarningHandler& warn, SceneLook look,
                              SurfaceModel model = SurfaceModel::matte, const std::string& animation = {});

/// A summary in one line: objects, triangles, materials, textures, cameras, animation.
std::string summary(const SceneFile& file);

}  // namespace esim::inline scene
