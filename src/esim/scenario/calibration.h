#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "esim/geometry/camera.h"
#include "esim/geometry/se3.h"

namespace esim {

/// One camera of a calibrated rig.
struct CalibratedCamera {
  std::string name;
  Camera model;
  SE3 T_body_camera;
};

/// Reads the cameras of a rig, in the file's order, from
///  - a Kalibr camchain (`cam0: {camera_model: pinhole, intrinsics, distortion_model, ...}`): the body is the IMU where
///    the file has T_cam_imu, and cam0 otherwise;
///  - the original ESIM's rig file (`cameras: - camera: {...}  T_B_C: {...}`).
/// Throws UserError naming the file and the camera for anything missing, inconsistent or not supported.
std::vector<CalibratedCamera> read_calibration(const std::filesystem::path& file);

}  // namespace esim
