#include "esim/scene/import/gloss_textures.h"

#include <fmt/format.h>

#include <algorithm>

namespace esim::inline scene {
namespace {

constexpr const char* kNoRelief = "its surfaces have no relief";

float clamped(const char* what, float value, const std::string& material, const WarningHandler& warn) {
  if (value >= 0 && value <= 1) return value;
  const float nearest = std::clamp(value, 0.0F, 1.0F);
  warn(fmt::format("material {}: its {} must be from 0 to 1, not {}; it is taken as {}", material, what, value,
                   nearest));
  return nearest;
}

/// Unit normals from texels, whose x and y are multiplied by `scale` first (glTF 2.0, normalTextureInfo.scale), stored
/// as in Gloss.
void normalise(float scale, Planes& planes) {
  for (std::size_t i = 0; i < planes[0].size(); ++i) {
    float& x = planes[0].data()[i];
    float& y = planes[1].data()[i];
    float& z = planes[2].data()[i];
    Eigen::Vector3f n(scale * (2 * x - 1), scale * (2 * y - 1), 2 * z - 1);
    const float length = n.norm();
    n = length > 1e-6F ? Eigen::Vector3f(n / length) : Eigen::Vector3f(Eigen::Vector3f::UnitZ());
    x = 0.5F + 0.5F * n.x(), y = 0.5F + 0.5F * n.y(), z = 0.5F + 0.5F * n.z();
  }
}

}  // namespace

std::shared_ptr<const Texture> GlossTextures::channel(const GraphTexture& slot, std::size_t which,
                                                      const std::string& material, const std::string& assumed) {
  if (slot.image < 0) return nullptr;
  const auto [entry, is_new] = channels_.try_emplace({slot.image, slot.wrap_u, slot.wrap_v, which});
  if (!is_new) return entry->second;
  const Planes planes = store_.numbers(slot, material, assumed);
  if (!planes.empty()) entry->second = std::make_shared<const Texture>(planes[which], slot.wrap_u, slot.wrap_v);
  return entry->second;
}

GlossTextures::Normals GlossTextures::normals(const GraphTexture& slot, float scale, const std::string& material) {
  if (slot.image < 0) return {};
  const auto [entry, is_new] = normals_.try_emplace({slot.image, slot.wrap_u, slot.wrap_v, scale});
  if (!is_new) return entry->second;
  Planes planes = store_.numbers(slot, material, kNoRelief);
  if (planes.empty()) return {};
  normalise(scale, planes);
  for (std::size_t c = 0; c < 3; ++c)
    entry->second[c] = std::make_shared<const Texture>(planes[c], slot.wrap_u, slot.wrap_v);
  return entry->second;
}

std::shared_ptr<const Gloss> GlossTextures::convert(const GraphMaterial& source) {
  constexpr std::size_t kGreen = 1, kBlue = 2;  // of glTF's images; the channels of a grey image are equal
  const std::string& name = source.name;
  Gloss gloss;
  gloss.metallic = clamped("metallic factor", source.metallic, name, store_.warning());
  gloss.roughness = clamped("roughness", source.roughness, name, store_.warning());
  gloss.reflectance = clamped("reflectance", source.reflectance, name, store_.warning());
  gloss.edge_reflectance = clamped("specular factor", source.edge_reflectance, name, store_.warning());
  const std::string even_roughness = fmt::format("its roughness is {} everywhere", gloss.roughness),
                    even_metallic = fmt::format("its metallic factor is {} everywhere", gloss.metallic);
  if (store_.look() == SceneLook::coded) {
    gloss.coded_roughness = store_.coded(source.roughness_texture, name, even_roughness);
    gloss.coded_metallic = store_.coded(source.metallic_texture, name, even_metallic);
    gloss.coded_normals = store_.coded(source.normal_texture, name, kNoRelief);
    gloss.normal_scale = source.normal_scale;
  } else {
    gloss.roughness_texture = channel(source.roughness_texture, kGreen, name, even_roughness);
    gloss.metallic_texture = channel(source.metallic_texture, kBlue, name, even_metallic);
    gloss.normal_textures = normals(source.normal_texture, source.normal_scale, name);
  }
  return std::make_shared<const Gloss>(std::move(gloss));
}

}  // namespace esim::inline scene
