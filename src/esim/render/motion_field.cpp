#include "esim/render/motion_field.h"

#include <Eigen/Geometry>

namespace esim::inline render {
namespace {

Twist relative_to_world(const Kinematics& camera) {
  return {(camera.T_world_body.rotation.conjugate() * camera.velocity_world).cast<float>(),
          camera.omega_body.cast<float>()};
}

/// In the camera frame, the object's point at X moves at v_O + omega_O x (X - p), where p is the object's origin.
Twist relative_to_object(const Kinematics& camera, const Kinematics& object) {
  const Eigen::Quaterniond R_camera_world = camera.T_world_body.rotation.conjugate();
  const Eigen::Vector3d omega_camera = R_camera_world * (object.T_world_body.rotation * object.omega_body);
  const Eigen::Vector3d p = camera.T_world_body.inverse() * object.T_world_body.translation;
  const Eigen::Vector3d v = R_camera_world * (camera.velocity_world - object.velocity_world) + omega_camera.cross(p);
  return {v.cast<float>(), (camera.omega_body - omega_camera).cast<float>()};
}

/// Fills V of a row from column `begin` to `end`; `twist_at(column)` is the motion relative to what that pixel sees.
template <typename TwistAt>
inline void fill_row(const PixelRays& rays, int row, int begin, int end, Sample& sample, const TwistAt& twist_at) {
  const float *const x = rays.x.row(row), *const y = rays.y.row(row);
  const float *const du_dx = rays.du_dx.row(row), *const du_dy = rays.du_dy.row(row);
  const float *const dv_dx = rays.dv_dx.row(row), *const dv_dy = rays.dv_dy.row(row);
  const float* const depth = sample.depth.row(row);
  float* const motion_x = sample.motion_x.row(row);
  float* const motion_y = sample.motion_y.row(row);
#pragma GCC ivdep
  for (int i = begin; i < end; ++i) {
    const auto& [v, omega] = twist_at(i);

    // Velocity of the point divided by its depth: -v/Z - omega x b.
    const float inverse_depth = 1.0F / depth[i];
    const float wx = -v.x() * inverse_depth - (omega.y() - omega.z() * y[i]);
    const float wy = -v.y() * inverse_depth - (omega.z() * x[i] - omega.x());
    const float wz = -v.z() * inverse_depth - (omega.x() * y[i] - omega.y() * x[i]);

    // Velocity of the bearing, then of the pixel.
    const float bearing_x = wx - x[i] * wz;
    const float bearing_y = wy - y[i] * wz;
    motion_x[i] = du_dx[i] * bearing_x + du_dy[i] * bearing_y;
    motion_y[i] = dv_dx[i] * bearing_x + dv_dy[i] * bearing_y;
  }
}

}  // namespace

std::vector<Twist> relative_twists(const RenderRequest& request) {
  std::vector<Twist> twists = {relative_to_world(request.camera)};
  for (const Kinematics& object : request.objects) twists.push_back(relative_to_object(request.camera, object));
  return twists;
}

void motion_field(const PixelRays& rays, const std::vector<Twist>& twists, const Tile& tile, Sample& sample,
                  int every) {
  const int first = (tile.y + every - 1) / every * every;
  if (twists.size() == 1) {
    const Twist world = twists[0];
    for (int row = first; row < tile.y + tile.height; row += every) {
      fill_row(rays, row, tile.x, tile.x + tile.width, sample, [world](int) { return world; });
    }
    return;
  }

  for (int row = first; row < tile.y + tile.height; row += every) {
    const std::uint16_t* const seen = sample.object.row(row);
    fill_row(rays, row, tile.x, tile.x + tile.width, sample, [&](int i) -> const Twist& { return twists[seen[i]]; });
  }
}

void add_to_motion_field(const PixelRays& rays, int x, int y, const Eigen::Vector3f& velocity, Sample& sample) {
  const Eigen::Vector3f w = velocity / sample.depth(x, y);
  const float bearing_x = w.x() - rays.x(x, y) * w.z(), bearing_y = w.y() - rays.y(x, y) * w.z();
  sample.motion_x(x, y) += rays.du_dx(x, y) * bearing_x + rays.du_dy(x, y) * bearing_y;
  sample.motion_y(x, y) += rays.dv_dx(x, y) * bearing_x + rays.dv_dy(x, y) * bearing_y;
}

}  // namespace esim::inline render
