#include "esim/truth/bearings.h"

namespace esim::inline truth {

Image<Eigen::Vector2d> bearings_of(const Camera& camera) {
  Image<Eigen::Vector2d> bearings(camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) bearings(x, y) = camera.back_project({x, y}).value().bearing.head<2>();
  return bearings;
}

}  // namespace esim::inline truth
