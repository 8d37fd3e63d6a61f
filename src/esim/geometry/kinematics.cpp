#include "esim/geometry/kinematics.h"

namespace esim::inline geometry {

Kinematics rigidly_attached(const Kinematics& body, const SE3& T_body_camera) {
  const Eigen::Quaterniond& R_world_body = body.T_world_body.rotation;
  const Eigen::Quaterniond R_camera_body = T_body_camera.rotation.conjugate();
  const Eigen::Vector3d& lever = T_body_camera.translation;
  const Eigen::Vector3d& omega = body.omega_body;

  Kinematics camera;
  camera.T_world_body = body.T_world_body * T_body_camera;
  camera.velocity_world = body.velocity_world + R_world_body * omega.cross(lever);
  camera.acceleration_world =
      body.acceleration_world + R_world_body * (body.alpha_body.cross(lever) + omega.cross(omega.cross(lever)));
  camera.omega_body = R_camera_body * omega;
  camera.alpha_body = R_camera_body * body.alpha_body;
  return camera;
}

}  // namespace esim::inline geometry
