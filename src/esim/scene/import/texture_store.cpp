#include "esim/scene/import/texture_store.h"

#include <fmt/format.h>

#include <span>

#include "esim/scene/images/image_file.h"
#include "esim/scene/images/image_header.h"
#include "esim/scene/import/folder.h"

namespace esim::inline scene {
namespace {

constexpr double kMaxTexels = 8192.0 * 8192.0;

bool is_grey(const Eigen::Vector3f& factor) { return factor[0] == factor[1] && factor[1] == factor[2]; }

Image<float> times(float factor, Image<float> image) {
  for (float& value : image.pixels()) value *= factor;
  return image;
}

Image<float> luminance_of(Planes& planes, const Eigen::Vector3f& factor) {
  if (planes.size() == 1) return times(factor[0], std::move(planes[0]));
  Image<float> result(planes[0].width(), planes[0].height());
  for (std::size_t i = 0; i < result.size(); ++i) {
    const float red = planes[0].data()[i], green = planes[1].data()[i], blue = planes[2].data()[i];
    result.data()[i] = is_grey(factor) ? factor[0] * luminance(red, green, blue)
                                       : luminance(factor[0] * red, factor[1] * green, factor[2] * blue);
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

Planes decoded(const CodedTexture& texture, bool colour) {
  Planes planes;
  check_size(texture.bytes, texture.name);
  if (texture.file.empty() || texture.opaque) {
    const std::string name = texture.file.empty() ? texture.name : texture.file.string();
    decode_planes(texture.bytes, name, Encoding::automatic, colour, planes);
  } else {
    load_planes(texture.file, Encoding::automatic, colour, planes);
  }
  return planes;
}

CodedTexture TextureStore::read(const GraphTexture& slot) const {
  const GraphImage& image = graph_.images[static_cast<std::size_t>(slot.image)];
  CodedTexture texture{image.name, {}, image.bytes, true, slot.wrap_u, slot.wrap_v};
  if (!image.bytes.empty()) return texture;
  const FolderPath inside = path_inside(folder_, image.name);
  if (!inside.path) throw UserError(fmt::format("texture '{}' {}", image.name, inside.reason));
  texture.file = *inside.path;
  texture.bytes = read_bytes(texture.file);
  texture.opaque = graph_.ignores_alpha;
  return texture;
}

TextureStore::Views TextureStore::views_of(const GraphTexture& slot, const Eigen::Vector3f& factor) {
  const bool colour = look_ == SceneLook::colour;
  Planes planes = decoded(read(slot), colour || !is_grey(factor));
  count_texels(planes);
  Views views;
  const auto keep = [&](View view, const Image<float>& image) {
    views[static_cast<std::size_t>(view)] = std::make_shared<const Texture>(image, slot.wrap_u, slot.wrap_v);
  };
  keep(View::luminance, luminance_of(planes, factor));
  if (!colour) return views;
  keep(View::red, times(factor[0], std::move(planes[0])));
  keep(View::green, times(factor[1], std::move(planes[1])));
  keep(View::blue, times(factor[2], std::move(planes[2])));
  return views;
}

std::shared_ptr<const Texture> TextureStore::get(const GraphTexture& slot, const Eigen::Vector3f& factor,
                                                 const std::string& material, View view) {
  if (slot.image < 0) return nullptr;
  const std::array<float, 3> factors{factor[0], factor[1], factor[2]};
  const auto [entry, is_new] = textures_.try_emplace({slot.image, slot.wrap_u, slot.wrap_v, factors});
  const auto& wanted = entry->second[static_cast<std::size_t>(view)];
  if (!is_new) return wanted;
  try {
    entry->second = views_of(slot, factor);
    ++image_count_;
  } catch (const UserError& error) {
    warn_failed(material, error);
  }
  return wanted;
}

std::shared_ptr<const CodedTexture> TextureStore::coded(const GraphTexture& slot, const std::string& material,
                                                        const std::string& assumed) {
  if (slot.image < 0) return nullptr;
  const auto [entry, is_new] = coded_.try_emplace({slot.image, slot.wrap_u, slot.wrap_v});
  if (!is_new) return entry->second;
  try {
    entry->second = std::make_shared<const CodedTexture>(read(slot));
    ++image_count_;
  } catch (const UserError& error) {
    warn_failed(material, error, assumed);
  }
  return entry->second;
}

Planes TextureStore::numbers(const GraphTexture& slot, const std::string& material, const std::string& assumed) {
  Planes planes;
  try {
    const CodedTexture image = read(slot);
    check_size(image.bytes, image.name);
    decode_planes(image.bytes, image.name, Encoding::linear, true, planes);
    count_texels(planes);
    ++image_count_;
  } catch (const UserError& error) {
    warn_failed(material, error, assumed);
    planes.clear();
  }
  return planes;
}

void TextureStore::count_texels(const Planes& planes) {
  texel_count_ += planes[0].size();
  if (texel_count_ > kMaxSceneTexels)
    throw UserError(fmt::format("the textures have more than {} texels in total; make them smaller", kMaxSceneTexels));
}

void TextureStore::warn_failed(const std::string& material, const UserError& error, const std::string& assumed) const {
  warn_(fmt::format("material {}: {}; {}", material, error.what(), assumed));
}

}  // namespace esim::inline scene
