#pragma once

#include <memory>

#include "esim/core/colour/colour.h"
#include "esim/scene/images/texture.h"
#include "esim/scene/planes.h"

namespace esim::inline scene {

/// The red, green and blue planes of an image; all null if they are unknown.
using ColourTextures = PerColour<std::shared_ptr<const Texture>>;

/// Makes textures of three planes.
inline ColourTextures colour_textures(const Planes& planes, Wrap wrap_u, Wrap wrap_v) {
  ColourTextures textures;
  for (std::size_t i = 0; i < textures.size(); ++i)
    textures[i] = std::make_shared<const Texture>(planes[i], wrap_u, wrap_v);
  return textures;
}

/// Samples an image behind RGGB filters for K pixels of a row, from (x, y) to the right: for each pixel the mean of its
/// own colour over its footprint.
template <int K>
std::array<float, K> sample_mosaic(const ColourTextures& textures, int x, int y, const TextureLookup<K>& at) {
  std::array<float, K> seen;
  for (const int column : {x, x + 1}) {  // each colour of a row is in every other pixel
    constexpr std::uint32_t kEveryOther = 0x55555555U;
    const auto first = static_cast<unsigned>(column - x);
    const std::array<float, K> light = textures[colour_at(column, y)]->template sample<K>(at, kEveryOther << first);
    for (std::size_t i = first; i < K; i += 2) seen[i] = light[i];
  }
  return seen;
}

}  // namespace esim::inline scene
