#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace esim::inline scene {

/// An attribute of a mesh that Draco compressed.
struct DracoAttribute {
  std::uint32_t id = 0;        ///< unique in the mesh
  std::size_t components = 0;  ///< per vertex
  bool whole = false;          ///< whole numbers, such as indices of joints; otherwise floats
  float unit = 1;              ///< integers are multiples of 1 / unit, unless Draco knows it (normalised integers)
};

/// Four bytes per number.
struct DracoMesh {
  std::size_t vertices = 0;
  std::vector<std::uint32_t> indices;              ///< of the triangles' vertices
  std::vector<std::vector<std::byte>> attributes;  ///< as requested: float or std::uint32_t
};

/// Decodes a mesh in a separate process, with bounded time and memory of at most `max_bytes` for the result. Throws
/// UserError "scene FILE: ..." if it is damaged, too large, or has no such attributes.
DracoMesh decode_draco(const std::filesystem::path& file, std::span<const std::byte> bytes,
                       const std::vector<DracoAttribute>& attributes, std::size_t max_bytes);

}  // namespace esim::inline scene
