#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "esim/core/colour/colour.h"
#include "esim/scene/images/texture.h"
#include "esim/scene/planes.h"

namespace esim::inline scene {

/// The form in which a scene is loaded.
enum class SceneLook {
  luminance,  ///< materials in luminance
  colour,     ///< also in each colour
  coded,      ///< factors in each colour; textures stay encoded as in their files (see CodedTexture)
};

/// What is loaded of a scene's materials.
enum class SurfaceModel {
  matte,   ///< base colour and emission
  glossy,  ///< also how they shine (see Gloss)
};

/// An encoded image.
struct CodedTexture {
  std::string name;                ///< for messages
  std::filesystem::path file{};    ///< empty: the image is embedded in the scene's file
  std::vector<std::byte> bytes{};  ///< of a PNG, a JPEG, ...
  bool opaque = false;             ///< transparency is ignored; otherwise it is composited over white
  Wrap wrap_u = Wrap::repeat, wrap_v = Wrap::repeat;
};

/// Linear light in three planes if `colour`, luminance otherwise. Throws UserError, naming the image, if it cannot be
/// decoded, or if it is larger than 8192 x 8192.
Planes decoded(const CodedTexture& texture, bool colour);

/// How a surface shines: the parameters of the metallic-roughness model of glTF 2.0 besides the base colour. The
/// textures are linear and multiplied by the factors.
struct Gloss {
  float metallic = 0;          ///< 0: dielectric, 1: metal
  float roughness = 1;         ///< perceptual, 0 to 1: the square root of the lobe's alpha
  float reflectance = 0.04F;   ///< of a dielectric at normal incidence (index of refraction 1.5)
  float edge_reflectance = 1;  ///< of a dielectric at grazing incidence
  std::shared_ptr<const Texture> metallic_texture{}, roughness_texture{};

  /// Components of normals, stored as (n + 1) / 2: x towards larger u, y towards smaller v, z outwards. Their mean over
  /// a pixel is shorter than 1 if they differ. All three or none.
  std::array<std::shared_ptr<const Texture>, 3> normal_textures{};

  // For SceneLook::coded, instead of the textures. A roughness is in the green channel, a metallic factor in the blue
  // one. The x and y of normals are still to be multiplied by the scale.
  std::shared_ptr<const CodedTexture> coded_roughness{}, coded_metallic{}, coded_normals{};
  float normal_scale = 1;
};

/// The appearance of a surface: its base colour, which is radiance if it is unlit and albedo if it is lit (see
/// Lighting), and its emission. Each is a factor times a texture, or the factor alone if the texture is null.
struct Material {
  std::string name;
  std::shared_ptr<const Texture> texture;  ///< of the base colour
  float base = 0.5F;
  std::shared_ptr<const Texture> emission_texture{};
  float emission = 0;                                             ///< radiance, added to that of the base colour
  bool unlit = false;                                             ///< shows its base colour in any light
  std::shared_ptr<const CodedTexture> coded{}, coded_emission{};  ///< for SceneLook::coded, instead of the textures
  std::shared_ptr<const Gloss> gloss{};  ///< for SurfaceModel::glossy; the same in luminance and in each colour
};

/// Textured triangles, in metres.
struct Mesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<Eigen::Vector3f> normals;                    ///< per vertex, for light only; empty or of length 0: flat
  std::vector<std::array<std::uint32_t, 3>> triangles;     ///< indices of vertices
  std::vector<std::array<Eigen::Vector2f, 3>> texture_uv;  ///< per triangle and corner; u right, v down
  std::vector<std::uint32_t> material;                     ///< per triangle: index of materials
  std::vector<Material> materials;                         ///< in luminance
  PerColour<std::vector<Material>> coloured;               ///< the same in each colour; empty if unknown
};

/// Receives a warning, as one line.
using WarningHandler = std::function<void(const std::string&)>;

/// Loads a scene file (see load_scene_file) as one static mesh, as at the start of its animation. Throws UserError,
/// naming the file, if it cannot be read, is damaged, or has no triangles.
Mesh load_mesh(const std::filesystem::path& path, const WarningHandler& warn, SceneLook look = SceneLook::luminance,
               SurfaceModel model = SurfaceModel::matte);

}  // namespace esim::inline scene
