#include "esim/record/formats/kalibr.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vector>

#include "esim/record/formats/rig_yaml.h"
#include "esim/record/output_file.h"

namespace esim {
namespace {

/// Kalibr's name for a distortion, and its coefficients.
struct KalibrDistortion {
  const char* model;
  std::vector<double> coefficients;
};

KalibrDistortion named(const NoDistortion&) { return {"none", {}}; }
KalibrDistortion named(const RadialTangential& d) {
  if (d.k3 == 0) return {"radtan", {d.k1, d.k2, d.p1, d.p2}};
  return {"radtan", {d.k1, d.k2, d.p1, d.p2, d.k3}};
}
KalibrDistortion named(const Equidistant& d) { return {"equidistant", {d.k1, d.k2, d.k3, d.k4}}; }
KalibrDistortion named(const Fov& d) { return {"fov", {d.w}}; }

std::string matrix(const char* key, const SE3& pose) {
  const Eigen::Matrix4d m = pose.matrix().array() + 0.0;  // no negative zeros
  std::string text = fmt::format("  {}:\n", key);
  for (int row = 0; row < 4; ++row)
    text += fmt::format("  - [{}, {}, {}, {}]\n", m(row, 0), m(row, 1), m(row, 2), m(row, 3));
  return text;
}

}  // namespace

std::string kalibr_camchain(const RecordingInfo& info) {
  std::string text;
  for (std::size_t i = 0; i < info.cameras.size(); ++i) {
    const auto& [name, model, T_body_camera] = info.cameras[i];
    const auto [distortion, coefficients] = std::visit([](const auto& kind) { return named(kind); }, model.distortion);
    text += fmt::format("cam{}:\n", i);
    text += "  camera_model: pinhole\n";
    text += fmt::format("  intrinsics: [{}, {}, {}, {}]\n", model.fx, model.fy, model.cx, model.cy);
    text += fmt::format("  distortion_model: {}\n", distortion);
    text += fmt::format("  distortion_coeffs: [{}]\n", fmt::join(coefficients, ", "));
    text += fmt::format("  resolution: [{}, {}]\n", model.width, model.height);
    text += fmt::format("  rostopic: /{}/image_raw\n", name);
    if (info.imu) {
      text += matrix("T_cam_imu", T_body_camera.inverse() * info.imu->T_body_imu);
      text += "  timeshift_cam_imu: 0.0\n";
    }
    if (i > 0) text += matrix("T_cn_cnm1", T_body_camera.inverse() * info.cameras[i - 1].T_body_camera);
  }
  return text;
}

std::string kalibr_imu(const ImuInfo& imu) {
  return fmt::format(
      "accelerometer_noise_density: {}  # m/s^2/sqrt(Hz)\n"
      "accelerometer_random_walk: {}  # m/s^3/sqrt(Hz)\n"
      "gyroscope_noise_density: {}  # rad/s/sqrt(Hz)\n"
      "gyroscope_random_walk: {}  # rad/s^2/sqrt(Hz)\n"
      "update_rate: {}  # Hz\n"
      "rostopic: /imu0\n",
      imu.accelerometer_noise_density, imu.accelerometer_random_walk, imu.gyroscope_noise_density,
      imu.gyroscope_random_walk, imu.rate_hz);
}

void CalibrationWriter::begin(const RecordingInfo& info) {
  std::filesystem::create_directories(folder_);
  write_file_atomically(folder_ / "camchain.yaml", kalibr_camchain(info));
  write_file_atomically(folder_ / "rig.yaml", rig_yaml(info));
  if (info.imu) write_file_atomically(folder_ / "imu.yaml", kalibr_imu(*info.imu));
}

}  // namespace esim
