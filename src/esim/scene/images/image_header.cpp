#include "esim/scene/images/image_header.h"

#include <algorithm>
#include <charconv>
#include <string_view>

namespace esim::inline scene {
namespace {

/// Reads integers of either byte order; 0 beyond the end.
class Bytes {
 public:
  explicit Bytes(std::span<const std::byte> bytes, bool big_endian = true) : bytes_(bytes), big_endian_(big_endian) {}

  std::int64_t at(std::size_t position, int count) const {
    std::int64_t value = 0;
    for (int i = 0; i < count; ++i) {
      const std::size_t from = position + static_cast<std::size_t>(big_endian_ ? i : count - 1 - i);
      if (from >= bytes_.size() || position > bytes_.size()) return 0;
      value = value << 8 | std::to_integer<std::int64_t>(bytes_[from]);
    }
    return value;
  }

 private:
  std::span<const std::byte> bytes_;
  bool big_endian_;
};

/// Marker after marker until the start of a frame.
std::optional<ImageSize> size_of_jpeg(std::span<const std::byte> head) {
  const Bytes bytes(head);
  for (std::size_t at = 2; at + 9 < head.size();) {
    if (bytes.at(at, 1) != 0xFF) return std::nullopt;
    const std::int64_t marker = bytes.at(at + 1, 1);
    if (marker == 0xFF) {
      ++at;
      continue;
    }
    const bool is_frame = marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
    if (is_frame) return ImageSize{bytes.at(at + 7, 2), bytes.at(at + 5, 2)};
    if (marker == 0xDA) return std::nullopt;
    at += 2 + static_cast<std::size_t>(std::max<std::int64_t>(bytes.at(at + 2, 2), 2));
  }
  return std::nullopt;
}

/// Sizes are stored minus one, except in lossy images.
std::optional<ImageSize> size_of_webp(std::span<const std::byte> head, std::string_view kind) {
  const Bytes bytes(head, false);
  constexpr std::int64_t kSide = (1 << 14) - 1;  // 14 bits
  if (kind == "VP8X") return ImageSize{bytes.at(24, 3) + 1, bytes.at(27, 3) + 1};
  if (kind == "VP8L") return ImageSize{(bytes.at(21, 4) & kSide) + 1, (bytes.at(21, 4) >> 14 & kSide) + 1};
  if (kind == "VP8 ") return ImageSize{bytes.at(26, 2) & kSide, bytes.at(28, 2) & kSide};
  return std::nullopt;
}

/// "-Y 512 +X 768" after an empty line.
std::optional<ImageSize> size_of_hdr(std::string_view text) {
  const std::size_t blank = text.find("\n\n");
  if (blank == std::string_view::npos) return std::nullopt;
  std::int64_t numbers[2] = {0, 0};
  std::size_t at = blank + 2;
  for (std::int64_t& number : numbers) {
    at = text.find_first_of("0123456789", at);
    if (at == std::string_view::npos) return std::nullopt;
    const auto end = std::from_chars(text.data() + at, text.data() + text.size(), number).ptr;
    at = static_cast<std::size_t>(end - text.data());
  }
  return ImageSize{numbers[1], numbers[0]};
}

}  // namespace

std::optional<ImageSize> size_in_header(std::span<const std::byte> head) {
  const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
  if (head.size() < 26) return std::nullopt;
  if (text.starts_with("\x89PNG")) return ImageSize{Bytes(head).at(16, 4), Bytes(head).at(20, 4)};
  if (text.starts_with("\xFF\xD8")) return size_of_jpeg(head);
  if (text.starts_with("#?")) return size_of_hdr(text);
  if (text.starts_with("RIFF") && text.substr(8, 4) == "WEBP") return size_of_webp(head, text.substr(12, 4));
  return std::nullopt;
}

}  // namespace esim::inline scene
