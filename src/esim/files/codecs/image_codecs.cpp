#include "esim/files/codecs/image_codecs.h"

#include <string_view>

#include "esim/files/codecs/decoders.h"

namespace esim::inline files {

bool decode_image(std::span<const std::byte> file, ImagePixels& pixels) {
  const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
  if (text.starts_with("\x89PNG\r\n\x1a\n")) return decode_png(file, pixels);
  if (text.starts_with("\xff\xd8\xff")) return decode_jpeg(file, pixels);
  if (text.starts_with("RIFF") && text.size() > 12 && text.substr(8, 4) == "WEBP") return decode_webp(file, pixels);
  if (text.starts_with("#?")) return decode_radiance(file, pixels);
  if (text.starts_with("P")) return decode_portable_map(file, pixels);
  return false;
}

}  // namespace esim::inline files
