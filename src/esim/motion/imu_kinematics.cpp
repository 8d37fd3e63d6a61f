#include "esim/motion/imu_kinematics.h"

namespace esim::inline motion {

InertialSignals inertial_signals(const Kinematics& body, const SE3& T_body_imu, const Eigen::Vector3d& gravity_world) {
  const Kinematics imu = rigidly_attached(body, T_body_imu);
  return {imu.omega_body, imu.T_world_body.rotation.conjugate() * (imu.acceleration_world - gravity_world)};
}

}  // namespace esim::inline motion
