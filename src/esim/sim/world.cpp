#include "esim/sim/world.h"

namespace esim {

RenderRequest view(const World& world, std::size_t camera, TimeNs t, std::vector<Tile> tiles) {
  RenderRequest request;
  request.t = t;
  request.camera = rigidly_attached(world.trajectory->at(t), world.info.cameras[camera].T_body_camera);
  request.tiles = std::move(tiles);
  for (const auto& object : world.objects) request.objects.push_back(object->at(t));
  return request;
}

RenderRequest view(const World& world, std::size_t camera, TimeNs t) {
  const Camera& model = world.info.cameras[camera].model;
  return view(world, camera, t, {{0, 0, model.width, model.height}});
}

}  // namespace esim
