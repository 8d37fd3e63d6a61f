#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "esim/scene/deformation/deformation.h"
#include "esim/scene/lighting.h"
#include "esim/scene/mesh.h"
#include "esim/scene/splats/splats.h"

namespace esim::inline scene {

/// A part of a scene: all that is static, or an object with its own motion.
struct SceneObject {
  std::string name;
  Mesh mesh;           ///< in the object's frame, which is the world frame if it does not move
  bool moves = false;  ///< each request contains its pose (see RenderRequest::objects)

  /// If set, the object consists of these instead of the mesh, which is empty.
  std::shared_ptr<const Splats> splats{};

  /// If set, the mesh deforms, and `mesh` is its shape at the start. Such an object `moves`, even if its pose rests.
  std::shared_ptr<const Deformation> deformation{};

  bool deforms() const { return deformation != nullptr; }
};

/// A scene for renderers of triangles.
struct Scene {
  std::vector<SceneObject> objects;
  std::optional<Lighting> lighting;  ///< if it is empty, surfaces show their base colour ("unlit")
};

/// An unlit scene of one static mesh.
Scene still_scene(Mesh mesh);

}  // namespace esim::inline scene
