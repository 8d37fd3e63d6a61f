#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "esim/geometry/camera.h"
#include "esim/geometry/se3.h"

namespace esim::inline geometry {

/// One camera of a calibrated rig.
struct CalibratedCamera {
  std::string name;
  Camera model;
  SE3 T_body_camera;
};

/// Reads the cameras of a rig, in the file's order, from
///  - a Kalibr camchain (`cam0: {camera_model: pinhole, intrinsics, distortion_model, ...}`): the body is the IMU where
///    the file has T_cam_imu, and cam0 otherwise. All sensors share one clock: a timeshift_cam_imu must be 0;
///  - the original ESIM's rig file (`cameras: - camera: {...}  T_B_C: {...}`);
///  - a COLMAP model (the folder, or its cameras.bin or cameras.txt): each of its cameras, named camera1 for number 1,
///  with
///    the body's pose;
///  - a transforms.json of NeRF, nerfstudio or instant-ngp: its different intrinsics, named camera1, camera2, ..., with
///    the body's pose. In both, the centre of the first pixel is (0.5, 0.5), so that cx and cy become smaller by 0.5.
/// Throws UserError, naming the file, the camera and the key, if a value is missing, inconsistent or not supported.
std::vector<CalibratedCamera> read_calibration(const std::filesystem::path& file);

/// The noise of an inertial measurement unit. Densities are for continuous time.
struct CalibratedImu {
  double rate_hz = 0;
  double gyroscope_noise_density = 0;      ///< rad/s/sqrt(Hz)
  double gyroscope_random_walk = 0;        ///< rad/s²/sqrt(Hz)
  double accelerometer_noise_density = 0;  ///< m/s²/sqrt(Hz)
  double accelerometer_random_walk = 0;    ///< m/s³/sqrt(Hz)
};

/// Reads Kalibr's imu.yaml: rate, noise densities and random walks, at the top or under `imu0`. The body of a camchain
/// with T_cam_imu is this IMU. Throws UserError as above, also for models with misalignment, several IMUs, and time
/// offsets.
CalibratedImu read_imu_calibration(const std::filesystem::path& file);

}  // namespace esim::inline geometry
