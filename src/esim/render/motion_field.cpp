#include "esim/render/motion_field.h"

namespace esim {

void motion_field(const PixelRays& rays, const Kinematics& camera, const Tile& tile, Sample& sample) {
  const Eigen::Vector3f v =
      (camera.T_world_body.rotation.conjugate() * camera.velocity_world).cast<float>();  // in the camera frame
  const Eigen::Vector3f omega = camera.omega_body.cast<float>();
  const float vx = v.x(), vy = v.y(), vz = v.z();
  const float ox = omega.x(), oy = omega.y(), oz = omega.z();

  for (int row = tile.y; row < tile.y + tile.height; ++row) {
    const float *const x = rays.x.row(row), *const y = rays.y.row(row);
    const float *const du_dx = rays.du_dx.row(row), *const du_dy = rays.du_dy.row(row);
    const float *const dv_dx = rays.dv_dx.row(row), *const dv_dy = rays.dv_dy.row(row);
    const float* const depth = sample.depth.row(row);
    float* const flow_x = sample.flow_x.row(row);
    float* const flow_y = sample.flow_y.row(row);
#pragma GCC ivdep
    for (int i = tile.x; i < tile.x + tile.width; ++i) {
      // Velocity of the point over its depth: -v/Z - omega x b.
      const float inverse_depth = 1.0F / depth[i];
      const float wx = -vx * inverse_depth - (oy - oz * y[i]);
      const float wy = -vy * inverse_depth - (oz * x[i] - ox);
      const float wz = -vz * inverse_depth - (ox * y[i] - oy * x[i]);

      // Velocity of the bearing, then of the pixel.
      const float bearing_x = wx - x[i] * wz;
      const float bearing_y = wy - y[i] * wz;
      flow_x[i] = du_dx[i] * bearing_x + du_dy[i] * bearing_y;
      flow_y[i] = dv_dx[i] * bearing_x + dv_dy[i] * bearing_y;
    }
  }
}

}  // namespace esim
