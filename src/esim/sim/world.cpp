#include "esim/sim/world.h"

#include <algorithm>

namespace esim::inline sim {
namespace {

RenderRequest view(const Kinematics& body, const SE3& T_body_camera,
                   std::span<const std::shared_ptr<const Trajectory>> objects, TimeNs t) {
  RenderRequest request;
  request.t = t;
  request.camera = rigidly_attached(body, T_body_camera);
  for (const auto& object : objects) request.objects.push_back(object->at(t));
  return request;
}

}  // namespace

std::function<RenderRequest(TimeNs)> view_at(const World& world, std::size_t camera) {
  return [trajectory = world.trajectory, objects = world.objects,
          T_body_camera = world.info.cameras[camera].T_body_camera](TimeNs t) {
    return view(trajectory->at(std::min(t, trajectory->end())), T_body_camera, objects, t);
  };
}

RenderRequest view(const World& world, std::size_t camera, TimeNs t, std::vector<Tile> tiles) {
  RenderRequest request = view(world.trajectory->at(t), world.info.cameras[camera].T_body_camera, world.objects, t);
  request.tiles = std::move(tiles);
  return request;
}

RenderRequest view(const World& world, std::size_t camera, TimeNs t) {
  const Camera& model = world.info.cameras[camera].model;
  return view(world, camera, t, {{0, 0, model.width, model.height}});
}

}  // namespace esim::inline sim
