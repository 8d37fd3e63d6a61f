#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

// Private to scene.
namespace esim::inline scene {

/// The vertices of a mesh file in its own order, which other readers change, and its faces.
struct NumberedMesh {
  std::vector<Eigen::Vector3f> vertices;

  /// Bytes that are only equal for files with the same faces. OBJ: the numbers of the vertices. PLY: what follows the
  /// vertices in the file.
  std::vector<std::byte> faces;
};

/// Throws UserError, naming the file, if it is not an OBJ or PLY file, or damaged, or if a vertex is not finite.
NumberedMesh read_numbered_mesh(const std::filesystem::path& file);

/// Colours of vertices in numbered_obj() have smaller components than this.
inline constexpr std::uint32_t kNumberBase = 1 << 16;

/// An OBJ file in which the colour of each vertex is its number n, which passes through readers that split vertices:
/// red is n % kNumberBase, green n / kNumberBase. `coloured`: whether there were colours before.
std::string numbered_obj(const std::filesystem::path& file, bool& coloured);

/// Throws the UserError "vertices FILE: REASON".
[[noreturn]] void fail_vertices(const std::filesystem::path& file, const std::string& reason);

}  // namespace esim::inline scene
