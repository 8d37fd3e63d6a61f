#include "esim/geometry/reconstruction/transforms.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "esim/core/error.h"
#include "esim/geometry/reconstruction/reconstruction.h"

namespace esim::inline geometry {
namespace {

using nlohmann::json;

/// One frame of a file, or what all frames share.
struct JsonObject {
  const std::filesystem::path& file;
  std::string name;
  const json& object;

  [[noreturn]] void fail(const std::string& message) const {
    throw UserError(fmt::format("{}: {}: {}", file.string(), name, message));
  }

  /// The value of a key; null if it is missing or null.
  const json* find(const char* key) const {
    const auto found = object.find(key);
    return found == object.end() || found->is_null() ? nullptr : &*found;
  }

  std::optional<double> number(const char* key) const {
    const json* const value = find(key);
    if (value == nullptr) return std::nullopt;
    if (!value->is_number()) fail(fmt::format("{} must be a number", key));
    return value->get<double>();
  }

  std::optional<std::string> text(const char* key) const {
    const json* const value = find(key);
    if (value == nullptr) return std::nullopt;
    if (!value->is_string()) fail(fmt::format("{} must be text", key));
    return value->get<std::string>();
  }
};

json load_json(const std::filesystem::path& file) {
  json root;
  try {
    root = json::parse(text_of_reconstruction(file));
  } catch (const json::parse_error& error) {
    throw UserError(
        fmt::format("{}: byte {}: is not valid JSON; correct the file or write it again", file.string(), error.byte));
  } catch (const json::exception&) {  // numbers that are too large for a double
    throw UserError(fmt::format("{}: contains a number that is not finite; write it again", file.string()));
  }
  if (!root.is_object() || !root.contains("frames") || !root["frames"].is_array())
    throw UserError(fmt::format("{}: must be a transforms.json, an object with a list of frames", file.string()));
  return root;
}

/// Calls body(section) for each frame.
template <typename Body>
void for_each_frame(const json& root, const std::filesystem::path& file, const Body& body) {
  std::size_t index = 0;
  for (const json& frame : root["frames"]) {
    const JsonObject section{file, fmt::format("frames[{}]", index++), frame};
    if (!frame.is_object()) section.fail("must be an object with a transform_matrix");
    body(section);
  }
}

SE3 pose_of(const JsonObject& frame) {
  constexpr const char* kKey = "transform_matrix";
  const json* const rows = frame.find(kKey);
  const auto refuse = [&] { frame.fail(fmt::format("{} must be a matrix of 4 x 4 numbers, camera to world", kKey)); };
  if (rows == nullptr || !rows->is_array() || (rows->size() != 3 && rows->size() != 4)) refuse();
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  for (std::size_t row = 0; row < rows->size(); ++row) {
    const json& values = (*rows)[row];
    if (!values.is_array() || values.size() != 4) refuse();
    for (std::size_t column = 0; column < 4; ++column) {
      if (!values[column].is_number()) refuse();
      matrix(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column)) = values[column].get<double>();
    }
  }
  try {
    const Eigen::Quaterniond half_turn(0, 1, 0, 0);  // from y down, z forward to y up, z backward
    return SE3::from_matrix(matrix) * SE3{half_turn, Eigen::Vector3d::Zero()};
  } catch (const UserError& error) {
    frame.fail(fmt::format("{}: {}", kKey, error.what()));
  }
}

/// The intrinsics of a frame as in the file. Two frames with the same ones have one camera.
struct Intrinsics {
  std::string model;
  bool fisheye = false;
  double width = 0, height = 0, fx = 0, fy = 0, cx = 0, cy = 0;
  double k1 = 0, k2 = 0, k3 = 0, k4 = 0, p1 = 0, p2 = 0;

  auto operator<=>(const Intrinsics&) const = default;
};

Intrinsics intrinsics_of(const JsonObject& frame, const JsonObject& shared) {
  const auto number = [&](const char* key) {
    const auto own = frame.number(key);
    return own ? own : shared.number(key);
  };
  const auto required = [&](const char* key, const char* meaning) {
    const auto value = number(key);
    if (!value)
      frame.fail(fmt::format("{}, {}, is missing; add it to the frame or to the top of the file", key, meaning));
    return *value;
  };
  const auto focal_length = [&](const char* key, const char* angle_key, double side) -> std::optional<double> {
    if (const auto value = number(key)) return value;
    const auto angle = number(angle_key);
    if (!angle) return std::nullopt;
    return 0.5 * side / std::tan(0.5 * *angle);
  };
  Intrinsics camera;
  const auto own_model = frame.text("camera_model");
  camera.model = own_model ? *own_model : shared.text("camera_model").value_or("OPENCV");
  const json* const own_fisheye = frame.find("is_fisheye");
  const json* const fisheye = own_fisheye != nullptr ? own_fisheye : shared.find("is_fisheye");
  camera.fisheye = camera.model == "OPENCV_FISHEYE" || (fisheye != nullptr && *fisheye == true);
  camera.width = required("w", "the width of the images in px");
  camera.height = required("h", "their height in px");
  const auto fx = focal_length("fl_x", "camera_angle_x", camera.width);
  if (!fx) frame.fail("fl_x and camera_angle_x are missing; add one of them to the frame or to the top of the file");
  camera.fx = *fx;
  camera.fy = focal_length("fl_y", "camera_angle_y", camera.height).value_or(camera.fx);
  camera.cx = number("cx").value_or(0.5 * camera.width);
  camera.cy = number("cy").value_or(0.5 * camera.height);
  camera.k1 = number("k1").value_or(0), camera.k2 = number("k2").value_or(0);
  camera.k3 = number("k3").value_or(0), camera.k4 = number("k4").value_or(0);
  camera.p1 = number("p1").value_or(0), camera.p2 = number("p2").value_or(0);
  return camera;
}

Distortion distortion_of(const Intrinsics& c) {
  constexpr std::array<const char*, 5> kPerspective{"OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "RADIAL", "SIMPLE_RADIAL"};
  const bool known = c.model == "OPENCV_FISHEYE" || std::ranges::find(kPerspective, c.model) != kPerspective.end();
  if (!known) {
    throw UserError(fmt::format(
        "camera_model '{}' is not supported; supported are OPENCV, OPENCV_FISHEYE, PINHOLE, SIMPLE_PINHOLE, RADIAL and "
        "SIMPLE_RADIAL",
        c.model));
  }
  if (c.fisheye) {
    if (c.p1 != 0 || c.p2 != 0) throw UserError("p1 and p2 must be 0 for a fisheye camera; remove them");
    return Equidistant{c.k1, c.k2, c.k3, c.k4};
  }
  if (c.k4 != 0) throw UserError("k4 is only supported for OPENCV_FISHEYE; it must be 0");
  if (c.k1 == 0 && c.k2 == 0 && c.k3 == 0 && c.p1 == 0 && c.p2 == 0) return NoDistortion{};
  return RadialTangential{c.k1, c.k2, c.p1, c.p2, c.k3};
}

}  // namespace

std::vector<TransformsFrame> read_transforms_frames(const std::filesystem::path& file) {
  const json root = load_json(file);
  std::vector<TransformsFrame> frames;
  std::size_t times = 0, timestamps = 0;
  for_each_frame(root, file, [&](const JsonObject& frame) {
    times += frame.number("time").has_value();
    timestamps += frame.number("timestamp").has_value();
    frames.push_back({frame.text("file_path").value_or(""), std::nullopt, pose_of(frame)});
  });
  const char* key = nullptr;
  if (times == frames.size()) {
    key = "time";
  } else if (timestamps == frames.size()) {
    key = "timestamp";
  }
  if (key == nullptr) return frames;
  std::size_t index = 0;
  for_each_frame(root, file, [&](const JsonObject& frame) { frames[index++].time_s = frame.number(key); });
  return frames;
}

std::vector<CalibratedCamera> read_transforms_calibration(const std::filesystem::path& file) {
  const json root = load_json(file);
  const JsonObject shared{file, "the file", root};
  std::set<Intrinsics> known;
  std::vector<CalibratedCamera> cameras;
  for_each_frame(root, file, [&](const JsonObject& frame) {
    const Intrinsics c = intrinsics_of(frame, shared);
    if (!known.insert(c).second) return;
    try {
      const Camera model = camera_of_corner(c.width, c.height, {c.fx, c.fy}, {c.cx, c.cy}, distortion_of(c));
      cameras.push_back({fmt::format("camera{}", cameras.size() + 1), model, SE3{}});
    } catch (const UserError& error) {
      frame.fail(error.what());
    }
  });
  if (cameras.empty()) throw UserError(fmt::format("{}: frames is empty; a camera needs one frame", file.string()));
  return cameras;
}

}  // namespace esim::inline geometry
