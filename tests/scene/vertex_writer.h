#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

namespace esim::test {

/// Positions of vertices per frame.
using Frames = std::vector<std::vector<Eigen::Vector3f>>;

template <typename T>
void append_bytes(std::string& bytes, T value, bool big_endian = false) {
  std::string of_value(reinterpret_cast<const char*>(&value), sizeof value);
  if (big_endian) std::reverse(of_value.begin(), of_value.end());
  bytes += of_value;
}

inline void append_frames(std::string& bytes, const Frames& frames, bool big_endian) {
  for (const auto& frame : frames) {
    for (const Eigen::Vector3f& vertex : frame) {
      for (const float coordinate : vertex) append_bytes(bytes, coordinate, big_endian);
    }
  }
}

/// A point cache in the format PC2.
inline std::string pc2(const Frames& frames, float start = 0, float frames_per_sample = 1) {
  std::string bytes("POINTCACHE2\0", 12);
  append_bytes(bytes, std::int32_t{1});
  append_bytes(bytes, static_cast<std::int32_t>(frames.at(0).size()));
  append_bytes(bytes, start), append_bytes(bytes, frames_per_sample);
  append_bytes(bytes, static_cast<std::int32_t>(frames.size()));
  append_frames(bytes, frames, false);
  return bytes;
}

/// A point cache in the format MDD.
inline std::string mdd(const Frames& frames, const std::vector<float>& times_s) {
  std::string bytes;
  append_bytes(bytes, static_cast<std::int32_t>(frames.size()), true);
  append_bytes(bytes, static_cast<std::int32_t>(frames.at(0).size()), true);
  for (const float t_s : times_s) append_bytes(bytes, t_s, true);
  append_frames(bytes, frames, true);
  return bytes;
}

/// A line of an OBJ file.
inline std::string obj_vertex(const Eigen::Vector3f& v) { return fmt::format("v {} {} {}\n", v[0], v[1], v[2]); }

/// A PLY file.
inline std::string ply(const std::vector<Eigen::Vector3f>& vertices, const std::vector<std::vector<std::size_t>>& faces,
                       bool binary) {
  std::string bytes = fmt::format(
      "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      binary ? "binary_little_endian" : "ascii", vertices.size(), faces.size());
  if (binary) {
    append_frames(bytes, {vertices}, false);
    for (const auto& face : faces) {
      append_bytes(bytes, static_cast<std::uint8_t>(face.size()));
      for (const std::size_t vertex : face) append_bytes(bytes, static_cast<std::int32_t>(vertex));
    }
    return bytes;
  }
  for (const Eigen::Vector3f& v : vertices) bytes += fmt::format("{} {} {}\n", v[0], v[1], v[2]);
  for (const auto& face : faces) {
    bytes += std::to_string(face.size());
    for (const std::size_t vertex : face) bytes += " " + std::to_string(vertex);
    bytes += "\n";
  }
  return bytes;
}

}  // namespace esim::test
