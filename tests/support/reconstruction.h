#pragma once

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

namespace esim::test {

/// A camera of a COLMAP model.
struct ModelCamera {
  std::uint32_t id = 1;
  std::int32_t number = 1;  ///< of the model
  std::string model = "PINHOLE";
  std::uint64_t width = 640, height = 480;
  std::vector<double> parameters{500, 510, 320, 240};
};

/// An image of a COLMAP model.
struct ModelImage {
  std::uint32_t id = 1;
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();  ///< world to camera
  Eigen::Vector3d t = Eigen::Vector3d::Zero();
  std::uint32_t camera = 1;
  std::string name;
  int points = 0;
};

template <typename T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

inline std::string cameras_bin(const std::vector<ModelCamera>& cameras) {
  std::string bytes;
  append(bytes, static_cast<std::uint64_t>(cameras.size()));
  for (const ModelCamera& camera : cameras) {
    append(bytes, camera.id);
    append(bytes, camera.number);
    append(bytes, camera.width);
    append(bytes, camera.height);
    for (const double value : camera.parameters) append(bytes, value);
  }
  return bytes;
}

inline std::string cameras_txt(const std::vector<ModelCamera>& cameras) {
  std::string text = "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
  for (const ModelCamera& camera : cameras) {
    text += fmt::format("{} {} {} {}", camera.id, camera.model, camera.width, camera.height);
    for (const double value : camera.parameters) text += fmt::format(" {}", value);
    text += "\n";
  }
  return text;
}

inline std::string images_bin(const std::vector<ModelImage>& images) {
  std::string bytes;
  append(bytes, static_cast<std::uint64_t>(images.size()));
  for (const ModelImage& image : images) {
    append(bytes, image.id);
    for (const double value : {image.q.w(), image.q.x(), image.q.y(), image.q.z()}) append(bytes, value);
    for (const double value : image.t) append(bytes, value);
    append(bytes, image.camera);
    bytes += image.name;
    bytes += '\0';
    append(bytes, static_cast<std::uint64_t>(image.points));
    for (int i = 0; i < image.points; ++i) {
      append(bytes, 12.5 + i);
      append(bytes, 100.25);
      append(bytes, std::int64_t{-1});
    }
  }
  return bytes;
}

inline std::string images_txt(const std::vector<ModelImage>& images) {
  std::string text = "# Image list with two lines of data per image:\n";
  for (const ModelImage& image : images) {
    text += fmt::format("{} {} {} {} {} {} {} {} {} {}\n", image.id, image.q.w(), image.q.x(), image.q.y(), image.q.z(),
                        image.t.x(), image.t.y(), image.t.z(), image.camera, image.name);
    for (int i = 0; i < image.points; ++i) text += fmt::format("{}{} 100.25 -1", i > 0 ? " " : "", 12.5 + i);
    text += "\n";
  }
  return text;
}

/// The frame of a transforms.json that shows the same as an image.
inline std::string frame_json(const ModelImage& image, const std::string& more = "") {
  Eigen::Isometry3d T_camera_world = Eigen::Isometry3d::Identity();
  T_camera_world.linear() = image.q.toRotationMatrix();
  T_camera_world.translation() = image.t;
  Eigen::Matrix4d m = T_camera_world.inverse().matrix();
  m.col(1) *= -1;
  m.col(2) *= -1;
  std::string rows;
  for (int i = 0; i < 4; ++i)
    rows += fmt::format("{}[{}, {}, {}, {}]", i > 0 ? ", " : "", m(i, 0), m(i, 1), m(i, 2), m(i, 3));
  return fmt::format(R"({{"file_path": "{}", "transform_matrix": [{}]{}}})", image.name, rows, more);
}

inline std::string transforms_json(const std::string& intrinsics, const std::vector<std::string>& frames) {
  std::string text = "{" + intrinsics + (intrinsics.empty() ? "" : ", ") + "\"frames\": [";
  for (std::size_t i = 0; i < frames.size(); ++i) text += (i > 0 ? ",\n" : "\n") + frames[i];
  return text + "]}\n";
}

}  // namespace esim::test
