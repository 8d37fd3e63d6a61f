#include "esim/formats/prophesee/prophesee.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>

namespace esim::inline formats::prophesee {
namespace {

constexpr std::size_t kMaxHeaderBytes = 1 << 16;
constexpr int kMaxStatedExtent = 65536;  // px

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

/// Takes the text before the separator, and the separator, off the start of `text`.
std::string_view take_until(std::string_view& text, char separator) {
  const std::size_t end = std::min(text.find(separator), text.size());
  const std::string_view part = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return trimmed(part);
}

std::string in_case(std::string_view text, int (*convert)(int)) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(convert(static_cast<unsigned char>(c)));
  return result;
}

int extent(std::string_view text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && value > 0 && value <= kMaxStatedExtent ? value : 0;
}

void take_property(std::string_view key, std::string_view value, Header& header) {
  const std::string name = in_case(key, std::tolower);
  if (name == "width") header.sensor.width = extent(value);
  if (name == "height") header.sensor.height = extent(value);
  if (name == "endianness") header.endianness = in_case(value, std::tolower);
}

/// "EVT3;height=720;width=1280"
void take_format(std::string_view value, Header& header) {
  header.encoding = in_case(take_until(value, ';'), std::toupper);
  while (!value.empty()) {
    std::string_view property = take_until(value, ';');
    const std::string_view key = take_until(property, '=');
    take_property(key, trimmed(property), header);
  }
}

void take_line(std::string_view line, Header& header) {
  std::string_view value = trimmed(line);
  const std::string_view key = take_until(value, ' ');
  value = trimmed(value);
  if (key == "format") {
    take_format(value, header);
  } else if (key == "evt" && header.encoding.empty()) {
    header.encoding = value == "2.0" ? "EVT2" : value == "2.1" ? "EVT21" : value == "3.0" ? "EVT3" : "";
  } else if (key == "geometry") {
    const int width = extent(take_until(value, 'x')), height = extent(trimmed(value));
    header.sensor = {width, height};
  } else {
    take_property(key, value, header);
  }
}

}  // namespace

Header parse_header(std::string_view head) {
  Header header;
  while (!header.ended && head.substr(header.bytes).starts_with("% ")) {
    const std::size_t end = head.find('\n', header.bytes);
    if (end == std::string_view::npos) break;
    const std::string_view line = head.substr(header.bytes + 2, end - header.bytes - 2);
    header.bytes = end + 1;
    header.ended = trimmed(line) == "end";
    take_line(line, header);
  }
  if (header.sensor.width == 0 || header.sensor.height == 0) header.sensor = {};
  return header;
}

Header read_header(InputFile& file) {
  const std::span<const std::byte> head = file.read(kMaxHeaderBytes);
  Header header = parse_header({reinterpret_cast<const char*>(head.data()), head.size()});
  file.seek(header.bytes);
  return header;
}

// No date, so that the same recording gives the same bytes. The plugin is the one with which Prophesee's tools read
// such files.
std::string raw_header(std::string_view encoding, std::string_view version, SensorSize sensor) {
  const bool known = sensor.width > 0;
  return fmt::format("% camera_integrator_name esim\n% evt {}\n% format {}{}\n{}", version, encoding,
                     known ? fmt::format(";height={};width={}", sensor.height, sensor.width) : "",
                     known ? fmt::format("% geometry {}x{}\n", sensor.width, sensor.height) : "") +
         "% integrator_name esim\n% plugin_integrator_name Prophesee\n% plugin_name hal_plugin_prophesee\n% end\n";
}

}  // namespace esim::inline formats::prophesee
