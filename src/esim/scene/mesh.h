#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "esim/core/colour.h"
#include "esim/scene/planes.h"
#include "esim/scene/texture.h"

namespace esim {

/// In which form a scene is loaded.
enum class SceneLook {
  luminance,  ///< materials in luminance
  colour,     ///< in each colour beside
  coded,  ///< factors in each colour; textures as they stand in their files, for others to decode (see CodedTexture)
};

/// An image as it stands in a file.
struct CodedTexture {
  std::string name;                ///< for messages
  std::filesystem::path file{};    ///< none: the image is a part of the scene's own file
  std::vector<std::byte> bytes{};  ///< of a PNG, a JPEG, ...
  bool opaque = false;             ///< transparency is ignored; else it is laid over white
  Wrap wrap_u = Wrap::repeat, wrap_v = Wrap::repeat;
};

/// Linear light in three planes if `colour`, luminance otherwise. Throws UserError naming the image where it cannot be
/// decoded, or is larger than 8192 x 8192.
Planes decoded(const CodedTexture& texture, bool colour);

/// How a surface looks: its base colour, which is radiance where it is unlit and albedo where light falls on it (see
/// Lighting), and what it emits by itself. Each is a factor times a texture, whose value counts as 1 where it is null.
struct Material {
  std::string name;
  std::shared_ptr<const Texture> texture;  ///< of the base colour
  float base = 0.5F;
  std::shared_ptr<const Texture> emission_texture{};
  float emission = 0;                                             ///< radiance, added to that of the base
  bool unlit = false;                                             ///< shows its base colour in whatever light
  std::shared_ptr<const CodedTexture> coded{}, coded_emission{};  ///< of SceneLook::coded, instead of the textures
};

/// Textured triangles, in metres.
struct Mesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<Eigen::Vector3f> normals;                    ///< per vertex, for light only; none, or of no length: flat
  std::vector<std::array<std::uint32_t, 3>> triangles;     ///< indices of vertices
  std::vector<std::array<Eigen::Vector2f, 3>> texture_uv;  ///< per triangle and corner; u right, v down
  std::vector<std::uint32_t> material;                     ///< per triangle: index of materials
  std::vector<Material> materials;                         ///< in luminance
  PerColour<std::vector<Material>> coloured;               ///< the same in each colour; empty where that is not known
};

/// Receives what is wrong but can be lived with, as one line.
using WarningHandler = std::function<void(const std::string&)>;

/// All that a scene file (see load_scene_file) shows, as one mesh that stands still: what is animated stays where it is
/// at the beginning. Throws UserError naming the file when it cannot be read, is damaged, or has no triangles.
Mesh load_mesh(const std::filesystem::path& path, const WarningHandler& warn, SceneLook look = SceneLook::luminance);

}  // namespace esim
