#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "esim/core/time.h"
#include "esim/geometry/se3.h"
#include "esim/scene/scene.h"

namespace esim {

/// Where something of a scene file is at a time of the file's animation.
struct ScenePose {
  TimeNs t = 0;
  SE3 T_world_object;
};

/// A motion as a scene file has it: poses in order of time, close enough together to be joined by a smooth curve. All
/// motions of a file span its whole animation. A single pose stands for no motion.
using SceneMotion = std::vector<ScenePose>;

struct SceneCamera {
  std::string name;
  std::optional<double> horizontal_fov_rad;
  SceneMotion motion;  ///< of the camera frame: x right, y down, z forward
};

/// What a scene file holds. Its world's z axis points up: see docs/scenes.md for each format's frame and units.
struct SceneFile {
  Scene scene;                       ///< first what stands still, if anything; then each subtree that is animated
  std::vector<SceneMotion> motions;  ///< of the scene's moving objects, in their order
  std::vector<SceneCamera> cameras;
  TimeSpan animation;           ///< of the file; empty where nothing moves
  std::size_t image_count = 0;  ///< images that were read
};

/// Reads a scene: OBJ with MTL, PLY, STL, glTF 2.0 (.gltf, .glb), FBX, Collada (.dae). Textures are read from the
/// scene's own folder and below; one that is missing, elsewhere or unreadable is a warning, and its surfaces are grey.
/// Throws UserError naming the file when it cannot be read, is damaged, or has no triangles.
SceneFile load_scene_file(const std::filesystem::path& path, const WarningHandler& warn,
                          SceneLook look = SceneLook::luminance);

/// One line for a person: objects, triangles, materials, textures, cameras, animation.
std::string summary(const SceneFile& file);

}  // namespace esim
