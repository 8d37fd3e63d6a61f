#pragma once

#include <string>
#include <vector>

#include "esim/scene/vertices/vertex_file.h"
#include "scene/vertex_writer.h"

namespace esim::test {

/// An OBJ file.
inline const std::string kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// Frames of its vertices.
inline Frames triangle_frames(std::size_t frames) {
  Frames result;
  for (std::size_t i = 0; i < frames; ++i) {
    const auto z = static_cast<float>(i);
    result.push_back({{0, 0, z}, {1, 0, 2 * z}, {0, 1, z * z}});
  }
  return result;
}

struct ObjectWithVertices {
  SceneObject object;
  std::vector<std::string> warnings;
};

inline ObjectWithVertices load_with_vertices(const std::filesystem::path& mesh, const VertexFile& vertices) {
  ObjectWithVertices loaded;
  loaded.object = load_object_with_vertices(
      mesh, vertices, [&](const std::string& text) { loaded.warnings.push_back(text); }, SceneLook::luminance);
  return loaded;
}

}  // namespace esim::test
