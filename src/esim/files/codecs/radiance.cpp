#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>
#include <string_view>

#include "esim/files/codecs/decoders.h"

// Radiance HDR: three mantissas of 8 bits with a common exponent, R G B E.
namespace esim::inline files {
namespace {

constexpr std::size_t kRgbeBytes = 4;  // of a pixel

/// Removes a line from `rest`; empty if it has no end.
std::optional<std::string_view> take_line(std::string_view& rest) {
  const std::size_t end = rest.find('\n');
  if (end == std::string_view::npos) return std::nullopt;
  const std::string_view line = rest.substr(0, end);
  rest.remove_prefix(end + 1);
  return line;
}

std::uint32_t take_side(std::string_view& text) {
  std::uint32_t number = 0;
  const auto end = std::from_chars(text.data(), text.data() + text.size(), number).ptr;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return number;
}

/// "-Y 512 +X 768", after the lines of the header and an empty one.
bool take_radiance_header(std::string_view& rest, std::uint32_t& width, std::uint32_t& height) {
  std::optional<std::string_view> line;
  while ((line = take_line(rest)) && !line->empty()) {
    if (line->starts_with("FORMAT=") && *line != "FORMAT=32-bit_rle_rgbe") return false;
  }
  line = take_line(rest);
  if (!line || !line->starts_with("-Y ")) return false;
  line->remove_prefix(3);
  height = take_side(*line);
  if (!line->starts_with(" +X ")) return false;
  line->remove_prefix(4);
  width = take_side(*line);
  return true;
}

/// Runs of one of the four components of a row.
bool take_component(std::string_view& rest, std::uint8_t* out, std::size_t width) {
  for (std::size_t x = 0; x < width;) {
    constexpr std::uint8_t kRun = 128;  // larger: so many equal bytes
    if (rest.size() < 2) return false;
    const auto count = static_cast<std::uint8_t>(rest[0]);
    const bool run = count > kRun;
    const std::size_t length = run ? count - kRun : count, coded = run ? 1 : length;
    if (length == 0 || length > width - x || rest.size() < 1 + coded) return false;
    for (std::size_t i = 0; i < length; ++i, ++x)
      out[kRgbeBytes * x] = static_cast<std::uint8_t>(rest[1 + (run ? 0 : i)]);
    rest.remove_prefix(1 + coded);
  }
  return true;
}

/// A row with components in runs, or its pixels as they are.
bool take_radiance_row(std::string_view& rest, std::vector<std::uint8_t>& row) {
  constexpr std::size_t kMinWidth = 8, kMaxWidth = 0x7fff;
  const std::size_t width = row.size() / kRgbeBytes;
  const char start[] = {2, 2, static_cast<char>(width >> 8), static_cast<char>(width & 0xff)};
  if (width >= kMinWidth && width <= kMaxWidth && rest.starts_with(std::string_view(start, sizeof start))) {
    rest.remove_prefix(sizeof start);
    for (std::size_t component = 0; component < kRgbeBytes; ++component) {
      if (!take_component(rest, row.data() + component, width)) return false;
    }
    return true;
  }
  if (rest.size() < row.size()) return false;
  std::memcpy(row.data(), rest.data(), row.size());
  rest.remove_prefix(row.size());
  return true;
}

}  // namespace

bool decode_radiance(std::span<const std::byte> file, ImagePixels& pixels) {
  std::string_view rest(reinterpret_cast<const char*>(file.data()), file.size());
  std::uint32_t width = 0, height = 0;
  if (!take_radiance_header(rest, width, height) || !is_plausible(width, height, file.size())) return false;
  pixels.resize(static_cast<int>(width), static_cast<int>(height), 3, 32);
  std::vector<std::uint8_t> row(kRgbeBytes * width);
  for (int y = 0; y < pixels.height; ++y) {
    if (!take_radiance_row(rest, row)) return false;
    auto* out = reinterpret_cast<float*>(pixels.row(y));
    for (std::size_t at = 0; at < row.size(); at += kRgbeBytes, out += 3) {
      constexpr int kBias = 128 + 8;
      const int exponent = row[at + 3];
      const float scale = exponent == 0 ? 0.0F : std::ldexp(1.0F, exponent - kBias);
      for (std::size_t c = 0; c < 3; ++c) out[c] = static_cast<float>(row[at + c]) * scale;
    }
  }
  return true;
}

}  // namespace esim::inline files
