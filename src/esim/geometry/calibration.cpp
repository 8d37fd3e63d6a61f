#include "esim/geometry/calibration.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <cmath>

#include "esim/core/error.h"
#include "esim/core/inputs/used_files.h"
#include "esim/geometry/reconstruction/colmap.h"
#include "esim/geometry/reconstruction/reconstruction.h"
#include "esim/geometry/reconstruction/transforms.h"

namespace esim::inline geometry {
namespace {

/// The section of one sensor in a file.
struct Section {
  const std::filesystem::path& file;
  std::string name;
  YAML::Node node;

  [[noreturn]] void fail(const std::string& message) const {
    throw UserError(fmt::format("calibration {}: {}: {}", file.string(), name, message));
  }

  YAML::Node at(const char* key) const {
    const YAML::Node value = node[key];
    if (!value.IsDefined()) fail(fmt::format("{} is missing", key));
    return value;
  }

  template <typename T>
  T as(const char* key) const {
    try {
      return at(key).as<T>();
    } catch (const YAML::Exception&) {
      fail(fmt::format("{} has the wrong type", key));
    }
  }

  /// Fails unless a time shift is 0 or absent.
  void require_no_shift(const char* key) const {
    if (node[key].IsDefined() && as<double>(key) != 0) {
      fail(fmt::format("{} is {} s, but all simulated sensors share one clock; set it to 0", key, as<double>(key)));
    }
  }

  /// The numbers of a flat list or of a list of rows.
  std::vector<double> numbers(const YAML::Node& list, const char* key, std::size_t count) const {
    std::vector<double> values;
    try {
      for (const YAML::Node& entry : list) {
        if (entry.IsSequence()) {
          for (const YAML::Node& value : entry) values.push_back(value.as<double>());
        } else {
          values.push_back(entry.as<double>());
        }
      }
    } catch (const YAML::Exception&) {
      fail(fmt::format("{} contains a value that is not a number", key));
    }
    if (values.size() != count) fail(fmt::format("{} must have {} numbers, not {}", key, count, values.size()));
    return values;
  }

  SE3 pose(const YAML::Node& list, const char* key) const {
    const std::vector<double> values = numbers(list, key, 16);
    try {
      return SE3::from_matrix(Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values.data()));
    } catch (const UserError& error) {
      fail(fmt::format("{}: {}", key, error.what()));
    }
  }
};

Distortion distortion_of(const Section& camera, const std::string& model, const YAML::Node& list, const char* key) {
  const auto four = [&] { return camera.numbers(list, key, 4); };
  if (model == "none") return NoDistortion{};
  if (model == "radtan" || model == "radial-tangential") {
    if (list.size() == 5) {
      const auto k = camera.numbers(list, key, 5);
      return RadialTangential{k[0], k[1], k[2], k[3], k[4]};
    }
    const auto k = four();
    return RadialTangential{k[0], k[1], k[2], k[3], 0.0};
  }
  if (model == "equidistant" || model == "equi") {
    const auto k = four();
    return Equidistant{k[0], k[1], k[2], k[3]};
  }
  if (model == "fov") return Fov{camera.numbers(list, key, 1)[0]};
  camera.fail(fmt::format(
      "distortion model '{}' is not supported; use none, radial-tangential (radtan), equidistant or fov", model));
}

Camera camera_of(const Section& camera, const std::string& projection, double width, double height,
                 const YAML::Node& intrinsics, const char* intrinsics_key, const Distortion& distortion) {
  const auto side = [&](double pixels) {
    constexpr double kMaxSide = 16384;
    if (!(pixels >= 1 && pixels <= kMaxSide) || pixels != std::floor(pixels))
      camera.fail(fmt::format("the image size is {} x {} px; width and height must be positive integers up to {}",
                              width, height, kMaxSide));
    return static_cast<int>(pixels);
  };
  if (projection != "pinhole") camera.fail(fmt::format("camera model '{}' is not supported; use pinhole", projection));
  const auto f = camera.numbers(intrinsics, intrinsics_key, 4);
  Camera model{side(width), side(height), f[0], f[1], f[2], f[3], distortion};
  try {
    model.validate();
  } catch (const UserError& error) {
    camera.fail(error.what());
  }
  return model;
}

/// The layout of the original ESIM.
std::vector<CalibratedCamera> read_rig(const YAML::Node& root, const std::filesystem::path& file) {
  std::vector<CalibratedCamera> cameras;
  for (std::size_t i = 0; i < root["cameras"].size(); ++i) {
    const YAML::Node entry = root["cameras"][i];
    const Section outer{file, fmt::format("cameras[{}]", i), entry};
    const Section camera{file, outer.name, outer.at("camera")};
    const Section distortion{file, outer.name + ".distortion", camera.at("distortion")};
    const YAML::Node parameters =
        distortion.node["parameters"].IsDefined() ? distortion.node["parameters"]["data"] : YAML::Node();
    const Camera model =
        camera_of(camera, camera.as<std::string>("type"), camera.as<double>("image_width"),
                  camera.as<double>("image_height"), camera.at("intrinsics")["data"], "intrinsics",
                  distortion_of(distortion, distortion.as<std::string>("type"), parameters, "parameters"));
    const std::string name =
        camera.node["label"].IsDefined() ? camera.as<std::string>("label") : fmt::format("cam{}", i);
    cameras.push_back({name, model, outer.pose(outer.at("T_B_C")["data"], "T_B_C")});
  }
  return cameras;
}

/// Kalibr's layout. T_cam_imu maps from the IMU to the camera, T_cn_cnm1 from the previous camera.
std::vector<CalibratedCamera> read_camchain(const YAML::Node& root, const std::filesystem::path& file) {
  std::vector<CalibratedCamera> cameras;
  for (int i = 0; root[fmt::format("cam{}", i)].IsDefined(); ++i) {
    const Section camera{file, fmt::format("cam{}", i), root[fmt::format("cam{}", i)]};
    const auto resolution = camera.numbers(camera.at("resolution"), "resolution", 2);
    const std::string distortion_model =
        camera.node["distortion_model"].IsDefined() ? camera.as<std::string>("distortion_model") : "none";
    const Camera model = camera_of(
        camera, camera.as<std::string>("camera_model"), resolution[0], resolution[1], camera.at("intrinsics"),
        "intrinsics", distortion_of(camera, distortion_model, camera.node["distortion_coeffs"], "distortion_coeffs"));

    camera.require_no_shift("timeshift_cam_imu");
    SE3 T_body_camera;
    if (const YAML::Node T_cam_imu = camera.node["T_cam_imu"]; T_cam_imu.IsDefined()) {
      T_body_camera = camera.pose(T_cam_imu, "T_cam_imu").inverse();
    } else if (i > 0) {
      T_body_camera = cameras.back().T_body_camera * camera.pose(camera.at("T_cn_cnm1"), "T_cn_cnm1").inverse();
    }
    cameras.push_back({camera.name, model, T_body_camera});
  }
  return cameras;
}

YAML::Node load(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error))
    throw UserError(fmt::format("calibration {}: no such file", file.string()));
  try {
    std::ifstream stream = open_input(file);
    if (!stream) throw UserError(fmt::format("calibration {}: cannot be read; check its permissions", file.string()));
    return YAML::Load(stream);
  } catch (const YAML::Exception& exception) {
    throw UserError(fmt::format("calibration {}:{}: {}", file.string(), exception.mark.line + 1, exception.msg));
  }
}

}  // namespace

std::vector<CalibratedCamera> read_calibration(const std::filesystem::path& file) {
  if (const auto found = find_reconstruction(file, ReconstructionPart::cameras)) {
    return found->kind == ReconstructionKind::colmap ? read_colmap_calibration(found->file)
                                                     : read_transforms_calibration(found->file);
  }
  const YAML::Node root = load(file);
  std::vector<CalibratedCamera> cameras;
  try {
    if (root.IsMap() && root["cameras"].IsDefined() && root["cameras"].IsSequence()) cameras = read_rig(root, file);
    if (root.IsMap() && root["cam0"].IsDefined()) cameras = read_camchain(root, file);
  } catch (const YAML::Exception& exception) {
    throw UserError(fmt::format("calibration {}: the layout is not as expected: {}", file.string(), exception.msg));
  }
  if (cameras.empty()) {
    throw UserError(
        fmt::format("calibration {}: contains no cameras; expected a Kalibr camchain (cam0: ...), a rig (cameras: - "
                    "camera: ...), a "
                    "COLMAP model (cameras.bin, cameras.txt) or a transforms.json",
                    file.string()));
  }
  return cameras;
}

CalibratedImu read_imu_calibration(const std::filesystem::path& file) {
  const YAML::Node root = load(file);
  if (!root.IsMap())
    throw UserError(fmt::format("calibration {}: is not an imu.yaml of Kalibr; it must be a map of keys and values",
                                file.string()));
  const bool nested = root["imu0"].IsDefined();
  const Section imu{file, "imu0", nested ? root["imu0"] : root};
  if (!imu.node.IsMap()) imu.fail("must be a map of keys and values");
  if (root["imu1"].IsDefined()) imu.fail("imu1 is also defined, but only one IMU is supported; remove the others");
  if (imu.node["model"].IsDefined() && imu.as<std::string>("model") != "calibrated") {
    imu.fail(fmt::format("model '{}' is not supported; use calibrated, and give scale and misalignment in the scenario",
                         imu.as<std::string>("model")));
  }
  imu.require_no_shift("time_offset");
  if (imu.node["T_i_b"].IsDefined() && !imu.pose(imu.node["T_i_b"], "T_i_b").matrix().isIdentity(1e-9))
    imu.fail("T_i_b is not the identity; remove it, and give the IMU's pose in the scenario as imu.T_body_imu");

  const auto not_negative = [&](const char* key, double limit) {
    const double value = imu.as<double>(key);
    if (!(value >= 0 && value <= limit)) imu.fail(fmt::format("{} is {}; it must be from 0 to {}", key, value, limit));
    return value;
  };
  constexpr double kMaxRate_hz = 1e9, kMaxDensity = 1e6;
  const CalibratedImu calibrated{
      .rate_hz = not_negative("update_rate", kMaxRate_hz),
      .gyroscope_noise_density = not_negative("gyroscope_noise_density", kMaxDensity),
      .gyroscope_random_walk = not_negative("gyroscope_random_walk", kMaxDensity),
      .accelerometer_noise_density = not_negative("accelerometer_noise_density", kMaxDensity),
      .accelerometer_random_walk = not_negative("accelerometer_random_walk", kMaxDensity)};
  if (calibrated.rate_hz == 0) imu.fail("update_rate is 0 Hz; it must be positive");
  return calibrated;
}

}  // namespace esim::inline geometry
