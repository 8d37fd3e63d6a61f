#pragma once

#include <optional>
#include <string>
#include <vector>

#include "esim/scene/lighting.h"
#include "esim/scene/mesh.h"

namespace esim {

/// A rigid part of a scene: what stands still, or a thing with a motion of its own.
struct SceneObject {
  std::string name;
  Mesh mesh;           ///< in the object's frame, which is the world's if it does not move
  bool moves = false;  ///< its pose at the time of rendering comes with the request (see RenderRequest::objects)
};

/// Everything that a renderer of triangles shows.
struct Scene {
  std::vector<SceneObject> objects;
  std::optional<Lighting> lighting;  ///< where there is none, surfaces show their base colour ("unlit")
};

/// A scene of one mesh that stands still, unlit.
Scene still_scene(Mesh mesh);

}  // namespace esim
