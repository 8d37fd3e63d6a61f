#include <webp/decode.h>

#include "esim/files/codecs/decoders.h"

namespace esim::inline files {

bool decode_webp(std::span<const std::byte> file, ImagePixels& pixels) {
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(file.data());
  WebPBitstreamFeatures features;
  if (WebPGetFeatures(bytes, file.size(), &features) != VP8_STATUS_OK || features.has_animation != 0) return false;
  const auto width = static_cast<std::uint64_t>(features.width), height = static_cast<std::uint64_t>(features.height);
  if (!is_plausible(width, height, file.size())) return false;
  pixels.resize(features.width, features.height, features.has_alpha != 0 ? 4 : 3, 8);
  const auto decode_into = features.has_alpha != 0 ? WebPDecodeRGBAInto : WebPDecodeRGBInto;
  return decode_into(bytes, file.size(), pixels.bytes.data(), pixels.bytes.size(),
                     static_cast<int>(pixels.row_bytes)) != nullptr;
}

}  // namespace esim::inline files
