#include "esim/scene/scene.h"

#include <algorithm>
#include <utility>

namespace esim {

Scene still_scene(Mesh mesh) {
  Scene scene;
  scene.objects.push_back({"world", std::move(mesh), false});
  return scene;
}

std::size_t count_moving(const Scene& scene) {
  return static_cast<std::size_t>(std::count_if(scene.objects.begin(), scene.objects.end(),
                                                [](const SceneObject& object) { return object.moves; }));
}

}  // namespace esim
