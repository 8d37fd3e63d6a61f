#include "esim/scene/scene.h"

#include <utility>

namespace esim::inline scene {

Scene still_scene(Mesh mesh) {
  Scene scene;
  scene.objects.push_back({"world", std::move(mesh), false});
  return scene;
}

}  // namespace esim::inline scene
