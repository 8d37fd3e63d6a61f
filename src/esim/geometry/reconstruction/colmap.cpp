#include "esim/geometry/reconstruction/colmap.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "esim/core/error.h"
#include "esim/geometry/reconstruction/colmap_models.h"
#include "esim/geometry/reconstruction/reconstruction.h"

namespace esim::inline geometry {
namespace {

constexpr std::size_t kUnsupported = 0;
/// By COLMAP's number.
constexpr std::array<ColmapModel, 18> kModels{{{"SIMPLE_PINHOLE", 3},
                                               {"PINHOLE", 4},
                                               {"SIMPLE_RADIAL", 4},
                                               {"RADIAL", 5},
                                               {"OPENCV", 8},
                                               {"OPENCV_FISHEYE", 8},
                                               {"FULL_OPENCV", 12},
                                               {"FOV", 5},
                                               {"SIMPLE_RADIAL_FISHEYE", 4},
                                               {"RADIAL_FISHEYE", 5},
                                               {"THIN_PRISM_FISHEYE", kUnsupported},
                                               {"RAD_TAN_THIN_PRISM_FISHEYE", kUnsupported},
                                               {"SIMPLE_DIVISION", kUnsupported},
                                               {"DIVISION", kUnsupported},
                                               {"SIMPLE_FISHEYE", kUnsupported},
                                               {"FISHEYE", kUnsupported},
                                               {"EUCM", kUnsupported},
                                               {"EQUIRECTANGULAR", kUnsupported}}};

[[noreturn]] void refuse(const std::string& model) {
  std::string supported;
  for (const ColmapModel& known : kModels) {
    if (known.parameters == kUnsupported) continue;
    if (!supported.empty()) supported += ", ";
    supported += known.name;
  }
  throw UserError(fmt::format(
      "camera model {} is not supported; supported are {}; COLMAP's image_undistorter makes a PINHOLE camera of any",
      model, supported));
}

Camera camera_of(const ColmapCamera& camera) {
  const std::vector<double>& p = camera.parameters;
  const auto one_focal_length = [&](const Distortion& distortion) {
    return camera_of_corner(camera.width, camera.height, {p[0], p[0]}, {p[1], p[2]}, distortion);
  };
  const auto two_focal_lengths = [&](const Distortion& distortion) {
    return camera_of_corner(camera.width, camera.height, {p[0], p[1]}, {p[2], p[3]}, distortion);
  };
  const std::string& model = camera.model;
  if (model == "SIMPLE_PINHOLE") return one_focal_length(NoDistortion{});
  if (model == "PINHOLE") return two_focal_lengths(NoDistortion{});
  if (model == "SIMPLE_RADIAL") return one_focal_length(RadialTangential{.k1 = p[3]});
  if (model == "RADIAL") return one_focal_length(RadialTangential{.k1 = p[3], .k2 = p[4]});
  if (model == "OPENCV") return two_focal_lengths(RadialTangential{p[4], p[5], p[6], p[7], 0.0});
  if (model == "OPENCV_FISHEYE") return two_focal_lengths(Equidistant{p[4], p[5], p[6], p[7]});
  if (model == "SIMPLE_RADIAL_FISHEYE") return one_focal_length(Equidistant{.k1 = p[3]});
  if (model == "RADIAL_FISHEYE") return one_focal_length(Equidistant{.k1 = p[3], .k2 = p[4]});
  if (model == "FOV") return two_focal_lengths(Fov{p[4]});
  // FULL_OPENCV
  if (p[9] != 0 || p[10] != 0 || p[11] != 0) {
    throw UserError(
        fmt::format("k4, k5 and k6 of FULL_OPENCV are {}, {} and {}; only 0 is supported; use the model OPENCV", p[9],
                    p[10], p[11]));
  }
  return two_focal_lengths(RadialTangential{p[4], p[5], p[6], p[7], p[8]});
}

bool is_binary(const std::filesystem::path& file) { return file.extension() == ".bin"; }

}  // namespace

const ColmapModel& colmap_model(std::int32_t number) {
  if (number < 0 || number >= static_cast<std::int32_t>(kModels.size())) refuse(fmt::format("{}", number));
  const ColmapModel& model = kModels[static_cast<std::size_t>(number)];
  if (model.parameters == kUnsupported) refuse(std::string(model.name));
  return model;
}

const ColmapModel& colmap_model(std::string_view name) {
  for (const ColmapModel& model : kModels) {
    if (model.name == name && model.parameters != kUnsupported) return model;
  }
  refuse(fmt::format("'{}'", name));
}

ColmapImage colmap_image(std::uint32_t id, const Eigen::Vector4d& q, const Eigen::Vector3d& t, std::uint32_t camera_id,
                         std::string name) {
  if (!q.allFinite()) throw UserError("the quaternion is not finite; remove the image from the model");
  if (!t.allFinite()) throw UserError("the translation is not finite; remove the image from the model");
  const double norm = q.stableNorm();
  if (!(norm > 1e-6)) throw UserError("the quaternion is zero; remove the image from the model");
  if (!std::isfinite(norm)) throw UserError("the quaternion is too large; remove the image from the model");
  Eigen::Quaterniond rotation(q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm);
  return {id, camera_id, {rotation, t}, std::move(name)};
}

std::vector<ColmapCamera> read_colmap_cameras(const std::filesystem::path& file) {
  return is_binary(file) ? read_colmap_cameras_binary(file) : read_colmap_cameras_text(file);
}

std::vector<ColmapImage> read_colmap_images(const std::filesystem::path& file) {
  return is_binary(file) ? read_colmap_images_binary(file) : read_colmap_images_text(file);
}

std::vector<CalibratedCamera> read_colmap_calibration(const std::filesystem::path& file) {
  std::vector<ColmapCamera> cameras = read_colmap_cameras(file);
  std::ranges::sort(cameras, {}, &ColmapCamera::id);
  std::vector<CalibratedCamera> calibrated;
  for (const ColmapCamera& camera : cameras) {
    const std::string name = fmt::format("camera{}", camera.id);
    const auto fail = [&](const std::string& message) {
      throw UserError(fmt::format("calibration {}: camera {}: {}", file.string(), camera.id, message));
    };
    if (!calibrated.empty() && calibrated.back().name == name) fail("occurs twice; remove one of them");
    try {
      calibrated.push_back({name, camera_of(camera), SE3{}});
    } catch (const UserError& error) {
      fail(error.what());
    }
  }
  if (calibrated.empty())
    throw UserError(fmt::format("calibration {}: contains no cameras; name another model", file.string()));
  return calibrated;
}

}  // namespace esim::inline geometry
