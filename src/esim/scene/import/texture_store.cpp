#include "esim/scene/import/texture_store.h"

#include <fmt/format.h>

#include <span>

#include "esim/scene/image_file.h"
#include "esim/scene/image_header.h"
#include "esim/scene/import/folder.h"

namespace esim {
namespace {

constexpr double kMaxTexels = 8192.0 * 8192.0;

bool is_grey(const Eigen::Vector3f& factor) { return factor[0] == factor[1] && factor[1] == factor[2]; }

Image<float> luminance_of(Planes& planes, const Eigen::Vector3f& factor) {
  Image<float> result = std::move(planes[0]);
  for (std::size_t i = 0; i < result.size(); ++i) {
    float& value = result.data()[i];
    value = planes.size() == 1
                ? factor[0] * value
                : luminance(factor[0] * value, factor[1] * planes[1].data()[i], factor[2] * planes[2].data()[i]);
  }
  return result;
}

void check_size(std::span<const std::byte> content, const std::string& name) {
  const auto size = size_in_header(content);
  if (size && static_cast<double>(size->width) * static_cast<double>(size->height) > kMaxTexels)
    throw UserError(
        fmt::format("texture {}: has {}x{} texels; make it at most 8192x8192", name, size->width, size->height));
}

}  // namespace

Planes TextureStore::decoded(const GraphImage& image, bool colour) {
  Planes planes;
  if (!image.bytes.empty()) {
    check_size(image.bytes, image.name);
    decode_planes(image.bytes, image.name, Encoding::automatic, colour, planes);
    return planes;
  }
  const FolderPath inside = path_inside(folder_, image.name);
  if (!inside.path) throw UserError(fmt::format("texture '{}' {}", image.name, inside.reason));
  const std::vector<std::byte> content = read_bytes(*inside.path);
  check_size(content, image.name);
  if (graph_.ignores_alpha) {
    decode_planes(content, inside.path->string(), Encoding::automatic, colour, planes);
  } else {
    load_planes(*inside.path, Encoding::automatic, colour, planes);
  }
  return planes;
}

std::shared_ptr<const Texture> TextureStore::get(const GraphTexture& slot, const Eigen::Vector3f& factor,
                                                 const std::string& material) {
  if (slot.image < 0) return nullptr;
  const std::array<float, 3> factors{factor[0], factor[1], factor[2]};
  const auto [entry, is_new] = textures_.try_emplace({slot.image, slot.wrap_u, slot.wrap_v, factors});
  if (!is_new) return entry->second;
  try {
    Planes planes = decoded(graph_.images[static_cast<std::size_t>(slot.image)], !is_grey(factor));
    texel_count_ += planes[0].size();
    if (texel_count_ > kMaxSceneTexels)
      throw UserError(fmt::format("its textures have more than {} texels in all; make them smaller", kMaxSceneTexels));
    entry->second = std::make_shared<const Texture>(luminance_of(planes, factor), slot.wrap_u, slot.wrap_v);
    ++image_count_;
  } catch (const UserError& error) {
    warn_(fmt::format("material {}: {}; its surfaces are grey", material, error.what()));
  }
  return entry->second;
}

}  // namespace esim
