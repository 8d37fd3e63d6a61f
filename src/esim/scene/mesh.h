#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "esim/scene/texture.h"

namespace esim {

/// What a surface emits towards the camera: a texture, or one radiance where there is none.
struct Material {
  std::string name;
  std::shared_ptr<const Texture> texture;  ///< radiance; may be null
  float radiance = 0.5F;                   ///< used where texture is null
};

/// Textured triangles in world coordinates (m).
struct Mesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;     ///< indices of vertices
  std::vector<std::array<Eigen::Vector2f, 3>> texture_uv;  ///< per triangle and corner; u right, v down
  std::vector<std::uint32_t> material;                     ///< per triangle: index of materials
  std::vector<Material> materials;
};

/// Receives what is wrong but can be lived with, as one line.
using WarningHandler = std::function<void(const std::string&)>;

/// Reads a textured mesh (OBJ with MTL). Textures are found relative to the file; one that is missing or unreadable is
/// a warning, and its surfaces are grey. Where a material has a texture, the texture alone is the radiance ("unlit").
/// Throws UserError naming the file when it cannot be read or has no triangles.
Mesh load_mesh(const std::filesystem::path& path, const WarningHandler& warn);

}  // namespace esim
