#pragma once

#include <filesystem>
#include <string>
#include <utility>

#include "esim/recording/record.h"

namespace esim::inline formats {

/// The cameras of a recording as a Kalibr camchain: `cam0`, `cam1`, ... in their order. With an IMU, each has T_cam_imu
/// (p_cam = T_cam_imu p_imu) and a time shift of 0; each but the first has T_cn_cnm1, the transform from the previous
/// camera. Numbers are read back exactly. Kalibr supports four coefficients of radtan: a fifth, k3, is written only if
/// it is not 0.
std::string kalibr_camchain(const RecordingInfo& info);

/// An IMU as Kalibr's imu.yaml.
std::string kalibr_imu(const ImuInfo& imu);

/// The cameras of a recording as a rig file of the original ESIM: each with its model and T_B_C, the pose of the camera
/// in the body frame. Numbers are read back exactly. The format does not hold an IMU.
std::string rig_yaml(const RecordingInfo& info);

/// Writes camchain.yaml, rig.yaml (the original ESIM's) and, with an IMU, imu.yaml into a folder when a recording
/// begins.
class CalibrationWriter final : public Sink {
 public:
  explicit CalibrationWriter(std::filesystem::path folder) : folder_(std::move(folder)) {}

  void begin(const RecordingInfo& info) override;
  void write(const Record&) override {}
  void end(bool) override {}

 private:
  std::filesystem::path folder_;
};

}  // namespace esim::inline formats
