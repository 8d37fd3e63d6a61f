#include "esim/formats/aedat4/description.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <utility>

namespace esim::inline formats::aedat4 {
namespace {

constexpr std::size_t kDeepest = 32;
constexpr std::size_t kMaxStreams = 1024;
constexpr int kLargestExtent = 65536;  // px

constexpr std::array<std::pair<std::string_view, std::string_view>, 5> kEntities = {
    {{"&lt;", "<"}, {"&gt;", ">"}, {"&quot;", "\""}, {"&apos;", "'"}, {"&amp;", "&"}}};

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    std::string_view put(&c, 1);
    for (const auto& [entity, plain] : kEntities) {
      if (plain == put) put = entity;
    }
    result += put;
  }
  return result;
}

std::string unescaped(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    std::string_view put = text.substr(0, 1), taken = put;
    for (const auto& [entity, plain] : kEntities) {
      if (text.starts_with(entity)) put = plain, taken = entity;
    }
    result += put;
    text.remove_prefix(taken.size());
  }
  return result;
}

/// The value of the attribute `name="value"` in a tag.
std::string_view attribute(std::string_view tag, std::string_view name) {
  const std::string key = fmt::format(" {}=\"", name);
  const std::size_t found = tag.find(key);
  if (found == std::string_view::npos) return {};
  tag.remove_prefix(found + key.size());
  return tag.substr(0, tag.find('"'));
}

std::optional<int> whole_number(std::string_view text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

int extent(std::string_view text) {
  const int value = whole_number(text).value_or(0);
  return value > 0 && value <= kLargestExtent ? value : 0;
}

/// Applies one `attr` of outInfo/ID or outInfo/ID/info.
void take(Stream& stream, bool of_info, std::string_view key, std::string_view value) {
  if (!of_info && key == "typeIdentifier") stream.type = value;
  if (of_info && key == "source") stream.source = unescaped(value);
  if (of_info && key == "sizeX") stream.width = extent(value);
  if (of_info && key == "sizeY") stream.height = extent(value);
}

std::string_view words(std::string_view type) {
  if (type == "EVTS") return "events";
  if (type == "FRME") return "frames";
  if (type == "TRIG") return "triggers";
  return "imu";
}

}  // namespace

std::string describe(const std::vector<Stream>& streams, std::string_view packing) {
  const auto attr = [](std::string_view indent, std::string_view key, const auto& value, std::string_view type) {
    return fmt::format("{}<attr key=\"{}\" type=\"{}\">{}</attr>\n", indent, key, type, value);
  };
  std::string text = "<dv version=\"2.0\">\n    <node name=\"outInfo\" path=\"/outInfo/\">\n";
  for (const Stream& stream : streams) {
    constexpr std::string_view kIndent = "            ", kDeeper = "                ";
    text += fmt::format("        <node name=\"{0}\" path=\"/outInfo/{0}/\">\n", stream.id);
    text += attr(kIndent, "compression", packing, "string");
    text += attr(kIndent, "originalModuleName", "esim", "string");
    text += attr(kIndent, "originalOutputName", words(stream.type), "string");
    text += attr(kIndent, "typeDescription", words(stream.type), "string");
    text += attr(kIndent, "typeIdentifier", stream.type, "string");
    text += fmt::format("            <node name=\"info\" path=\"/outInfo/{}/info/\">\n", stream.id);
    if (stream.width > 0) text += attr(kDeeper, "sizeX", stream.width, "int");
    if (stream.height > 0) text += attr(kDeeper, "sizeY", stream.height, "int");
    text += attr(kDeeper, "source", escaped(stream.source), "string");
    text += "            </node>\n        </node>\n";
  }
  return text + "    </node>\n</dv>\n";
}

std::optional<std::vector<Stream>> parse_description(std::string_view xml) {
  std::vector<Stream> streams;
  std::vector<std::string_view> nodes;  // open nodes
  for (std::size_t at = xml.find('<'); at != std::string_view::npos; at = xml.find('<', at)) {
    const std::size_t end = xml.find('>', at);
    if (end == std::string_view::npos) return std::nullopt;
    const std::string_view tag = xml.substr(at + 1, end - at - 1);
    at = end + 1;
    if (tag == "/node") {
      if (nodes.empty()) return std::nullopt;
      nodes.pop_back();
    } else if (tag.starts_with("node ") && !tag.ends_with('/')) {
      nodes.push_back(attribute(tag, "name"));
      if (nodes.size() > kDeepest) return std::nullopt;
      const auto id = nodes.size() == 2 && nodes[0] == "outInfo" ? whole_number(nodes[1]) : std::nullopt;
      if (id) streams.push_back({*id});
      if (streams.size() > kMaxStreams) return std::nullopt;
    } else if (tag.starts_with("attr ") && !streams.empty() && nodes.size() >= 2 && nodes[0] == "outInfo") {
      const bool of_stream = nodes.size() == 2, of_info = nodes.size() == 3 && nodes[2] == "info";
      const std::string_view value = xml.substr(at, xml.find('<', at) - at);
      const bool same = whole_number(nodes[1]) == streams.back().id;
      if (same && (of_stream || of_info)) take(streams.back(), of_info, attribute(tag, "key"), value);
    }
  }
  if (!nodes.empty()) return std::nullopt;
  std::erase_if(streams, [](const Stream& stream) { return stream.type.empty(); });
  return streams;
}

}  // namespace esim::inline formats::aedat4
