#include <bit>
#include <charconv>
#include <cstring>
#include <optional>
#include <string_view>

#include "esim/files/codecs/decoders.h"

// PGM and PPM: P2 and P3 as text, P5 and P6 as bytes.
namespace esim::inline files {
namespace {

constexpr std::uint32_t kMaxCode = 65535;

bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

/// Removes blanks, comments and a number from `rest`.
std::optional<std::uint32_t> take_map_number(std::string_view& rest) {
  while (!rest.empty() && (is_space(rest[0]) || rest[0] == '#'))
    rest.remove_prefix(rest[0] == '#' ? std::min(rest.find('\n'), rest.size()) : 1);
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
  if (error != std::errc()) return std::nullopt;
  rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  return number;
}

struct MapHeader {
  bool text = false;
  int channels = 1;
  std::uint32_t width = 0, height = 0, max = 0;
};

std::optional<MapHeader> take_map_header(std::string_view& rest) {
  if (rest.size() < 3 || std::string_view("2356").find(rest[1]) == std::string_view::npos) return std::nullopt;
  MapHeader header{.text = rest[1] < '5', .channels = rest[1] == '2' || rest[1] == '5' ? 1 : 3};
  rest.remove_prefix(2);
  for (std::uint32_t* number : {&header.width, &header.height, &header.max}) {
    const auto read = take_map_number(rest);
    if (!read) return std::nullopt;
    *number = *read;
  }
  if (header.max < 1 || header.max > kMaxCode) return std::nullopt;
  if (!header.text) {
    if (rest.empty() || !is_space(rest[0])) return std::nullopt;
    rest.remove_prefix(1);
  }
  return header;
}

/// Scales codes of 0 to `max` to all bits.
template <typename Code>
void scale_codes(std::span<Code> codes, std::uint32_t max) {
  constexpr std::uint32_t kFull = std::numeric_limits<Code>::max();
  if (max == kFull) return;
  for (Code& code : codes) code = static_cast<Code>(std::min<std::uint32_t>(code, max) * kFull / max);
}

template <typename Code>
bool read_codes(std::string_view rest, const MapHeader& header, ImagePixels& pixels) {
  const std::span<Code> codes(reinterpret_cast<Code*>(pixels.bytes.data()), pixels.bytes.size() / sizeof(Code));
  if (header.text) {
    for (Code& code : codes) {
      const auto number = take_map_number(rest);
      if (!number) return false;
      code = static_cast<Code>(std::min(*number, header.max));
    }
  } else {
    if (rest.size() < pixels.bytes.size()) return false;
    std::memcpy(pixels.bytes.data(), rest.data(), pixels.bytes.size());
    if (sizeof(Code) == 2 && std::endian::native == std::endian::little) {
      for (Code& code : codes) code = static_cast<Code>(code << 8 | code >> 8);
    }
  }
  scale_codes(codes, header.max);
  return true;
}

}  // namespace

bool decode_portable_map(std::span<const std::byte> file, ImagePixels& pixels) {
  std::string_view rest(reinterpret_cast<const char*>(file.data()), file.size());
  const std::optional<MapHeader> header = take_map_header(rest);
  if (!header || !is_plausible(header->width, header->height, file.size())) return false;
  const bool bytes = header->max <= 255;
  pixels.resize(static_cast<int>(header->width), static_cast<int>(header->height), header->channels, bytes ? 8 : 16);
  return bytes ? read_codes<std::uint8_t>(rest, *header, pixels) : read_codes<std::uint16_t>(rest, *header, pixels);
}

}  // namespace esim::inline files
