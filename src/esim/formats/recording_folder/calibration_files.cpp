#include "esim/formats/recording_folder/calibration_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vector>

#include "esim/files/output_file.h"

namespace esim::inline formats {
namespace {

/// The names of a distortion model in Kalibr and in the original ESIM, and its coefficients for both.
struct NamedDistortion {
  const char* kalibr;
  const char* rig;
  std::vector<double> coefficients;
};

NamedDistortion named(const NoDistortion&) { return {"none", "none", {}}; }
NamedDistortion named(const RadialTangential& d) {
  NamedDistortion result{"radtan", "radial-tangential", {d.k1, d.k2, d.p1, d.p2}};
  if (d.k3 != 0) result.coefficients.push_back(d.k3);
  return result;
}
NamedDistortion named(const Equidistant& d) { return {"equidistant", "equidistant", {d.k1, d.k2, d.k3, d.k4}}; }
NamedDistortion named(const Fov& d) { return {"fov", "fov", {d.w}}; }

NamedDistortion distortion_of(const Camera& camera) {
  return std::visit([](const auto& kind) { return named(kind); }, camera.distortion);
}

Eigen::Matrix4d without_negative_zeros(const SE3& pose) { return pose.matrix().array() + 0.0; }

/// A pose as a matrix in the style of Kalibr.
std::string rows(const char* key, const SE3& pose) {
  const Eigen::Matrix4d m = without_negative_zeros(pose);
  std::string text = fmt::format("  {}:\n", key);
  for (int row = 0; row < 4; ++row)
    text += fmt::format("  - [{}, {}, {}, {}]\n", m(row, 0), m(row, 1), m(row, 2), m(row, 3));
  return text;
}

/// A matrix in the style of the original ESIM's rig files.
std::string matrix(int indent, const char* key, int rows, int columns, const std::vector<double>& values) {
  return fmt::format("{0:{1}}{2}:\n{0:{1}}  cols: {3}\n{0:{1}}  rows: {4}\n{0:{1}}  data: [{5}]\n", "", indent, key,
                     columns, rows, fmt::join(values, ", "));
}

}  // namespace

std::string kalibr_camchain(const RecordingInfo& info) {
  std::string text;
  for (std::size_t i = 0; i < info.cameras.size(); ++i) {
    const auto& [name, model, T_body_camera, has_frames, has_labels, lens] = info.cameras[i];
    if (lens >= 0) continue;
    const NamedDistortion distortion = distortion_of(model);
    text += fmt::format("cam{}:\n", i);
    text += "  camera_model: pinhole\n";
    text += fmt::format("  intrinsics: [{}, {}, {}, {}]\n", model.fx, model.fy, model.cx, model.cy);
    text += fmt::format("  distortion_model: {}\n", distortion.kalibr);
    text += fmt::format("  distortion_coeffs: [{}]\n", fmt::join(distortion.coefficients, ", "));
    text += fmt::format("  resolution: [{}, {}]\n", model.width, model.height);
    text += fmt::format("  rostopic: /{}/image_raw\n", name);
    if (info.imu) {
      text += rows("T_cam_imu", T_body_camera.inverse() * info.imu->T_body_imu);
      text += "  timeshift_cam_imu: 0.0\n";
    }
    if (i > 0) text += rows("T_cn_cnm1", T_body_camera.inverse() * info.cameras[i - 1].T_body_camera);
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

std::string rig_yaml(const RecordingInfo& info) {
  std::string text = "label: \"esim\"\ncameras:\n";
  for (const auto& [name, model, T_body_camera, has_frames, has_labels, lens] : info.cameras) {
    if (lens >= 0) continue;
    const NamedDistortion distortion = distortion_of(model);
    text += fmt::format("- camera:\n    label: {}\n    line-delay-nanoseconds: 0\n", name);
    text += fmt::format("    image_height: {}\n    image_width: {}\n    type: pinhole\n", model.height, model.width);
    text += matrix(4, "intrinsics", 4, 1, {model.fx, model.fy, model.cx, model.cy});
    text += fmt::format("    distortion:\n      type: {}\n", distortion.rig);
    text += matrix(6, "parameters", static_cast<int>(distortion.coefficients.size()), 1, distortion.coefficients);
    const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> m = without_negative_zeros(T_body_camera);
    text += matrix(2, "T_B_C", 4, 4, std::vector<double>(m.data(), m.data() + m.size()));
  }
  return text;
}

void CalibrationWriter::begin(const RecordingInfo& info) {
  create_folder(folder_);
  write_file_atomically(folder_ / "camchain.yaml", kalibr_camchain(info));
  write_file_atomically(folder_ / "rig.yaml", rig_yaml(info));
  if (info.imu) write_file_atomically(folder_ / "imu.yaml", kalibr_imu(*info.imu));
}

}  // namespace esim::inline formats
