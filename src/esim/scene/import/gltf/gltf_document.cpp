#include "esim/scene/import/gltf/gltf_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "esim/core/load_unaligned.h"
#include "esim/scene/import/folder.h"
#include "esim/scene/import/scene_graph.h"

namespace esim::inline scene {
namespace {

using Json = GltfDocument::Json;

constexpr std::uint32_t kGlbMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;

/// Whether a number is finite, also in single precision.
bool is_finite_number(const Json& value) {
  return value.is_number() && std::abs(value.get<double>()) <= double{std::numeric_limits<float>::max()};
}

/// Empty for text that is not base64.
std::vector<std::byte> base64_decoded(std::string_view text) {
  static constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::array<std::int8_t, 256> value;
  value.fill(-1);
  for (std::size_t i = 0; i < kDigits.size(); ++i)
    value[static_cast<unsigned char>(kDigits[i])] = static_cast<std::int8_t>(i);
  std::vector<std::byte> bytes;
  bytes.reserve(text.size() / 4 * 3);
  std::uint32_t bits = 0;
  int held = 0;
  for (const char c : text) {
    if (c == '=') break;
    const int digit = value[static_cast<unsigned char>(c)];
    if (digit < 0) return {};
    bits = bits << 6 | static_cast<std::uint32_t>(digit);
    held += 6;
    if (held >= 8) bytes.push_back(static_cast<std::byte>(bits >> (held -= 8)));
  }
  return bytes;
}

}  // namespace

GltfDocument::GltfDocument(const std::filesystem::path& file) : file_(file) {
  std::vector<std::byte> content = read_bytes(file);
  std::vector<std::byte> binary;
  if (content.size() >= 4 && load_unaligned<std::uint32_t>(content.data()) == kGlbMagic) {
    constexpr std::size_t kHeader = 12, kChunkHeader = 8;
    if (content.size() < kHeader + kChunkHeader || load_unaligned<std::uint32_t>(&content[4]) != 2)
      fail("is not a GLB file of version 2, or is cut off");
    if (load_unaligned<std::uint32_t>(&content[8]) > content.size()) fail("is cut off: copy or export it again");
    std::size_t at = kHeader;
    for (int chunk = 0; at + kChunkHeader <= content.size(); ++chunk) {
      const std::size_t bytes = load_unaligned<std::uint32_t>(&content[at]);
      const auto type = load_unaligned<std::uint32_t>(&content[at + 4]);
      at += kChunkHeader;
      if (bytes > content.size() - at) fail("is cut off: copy or export it again");
      const std::span<const std::byte> data(content.data() + at, bytes);
      if (chunk == 0 && type != kJsonChunk) fail("is damaged: its first chunk is not JSON");
      if (chunk == 0) parse(data);
      if (chunk == 1 && type == kBinaryChunk) binary.assign(data.begin(), data.end());
      at += bytes;
    }
  } else {
    parse(content);
  }
  content = {};
  load_buffers(std::move(binary));
  decode_meshopt();
  decode_draco_meshes();
}

void GltfDocument::parse(std::span<const std::byte> text) {
  const auto* const begin = reinterpret_cast<const char*>(text.data());
  try {
    root_ = Json::parse(begin, begin + text.size());
  } catch (const Json::exception& error) {
    fail(fmt::format("is damaged: its JSON cannot be read ({})", error.what()));
  }
  const Json* const asset = find(root_, "asset");
  if (asset == nullptr || text.empty() || !this->text(*asset, "version").starts_with("2"))
    fail("is not glTF 2.0; export it again as glTF 2.0");
}

void GltfDocument::load_buffers(std::vector<std::byte> binary) {
  const Json& buffers = list("buffers");
  for (std::size_t i = 0; i < buffers.size(); ++i) {
    const std::string uri = text(buffers[i], "uri");
    if (uri.empty()) {
      buffers_.push_back(i == 0 ? std::exchange(binary, {}) : std::vector<std::byte>{});
    } else if (uri.starts_with("data:")) {
      buffers_.push_back(data_uri(uri));
    } else {
      const FolderPath inside = path_inside(file_.parent_path(), percent_decoded(uri));
      if (!inside.path) fail(fmt::format("its buffer '{}' {}; put it next to the file", uri, inside.reason));
      buffers_.push_back(read_bytes(*inside.path));
    }
    const bool is_placeholder = uri.empty() && is_fallback(buffers[i]);
    if (!is_placeholder && buffers_.back().size() < whole(buffers[i], "byteLength", 0))
      fail(fmt::format("buffer {} is cut off: it has {} bytes", i, buffers_.back().size()));
  }
}

void GltfDocument::fail(const std::string& reason) const { fail_scene(file_, reason); }

const Json& GltfDocument::list(const char* name) const {
  static const Json kNone = Json::array();
  const Json* const found = find(root_, name);
  if (found == nullptr) return kNone;
  if (!found->is_array()) fail(fmt::format("is damaged: {} is not a list", name));
  return *found;
}

std::size_t GltfDocument::first_scene() const {
  return has_index(root_, "scene") ? index(root_, "scene", "scenes") : 0;
}

const Json* GltfDocument::find(const Json& object, const char* name) {
  if (!object.is_object()) return nullptr;
  const auto found = object.find(name);
  return found == object.end() ? nullptr : &*found;
}

std::size_t GltfDocument::whole(const Json& object, const char* name, std::size_t otherwise) const {
  const Json* const found = find(object, name);
  if (found == nullptr) return otherwise;
  if (!found->is_number_unsigned()) fail(fmt::format("is damaged: {} is not an integer", name));
  const auto value = found->get<std::uint64_t>();
  if (value > std::numeric_limits<std::uint32_t>::max()) fail(fmt::format("is damaged: {} is {}", name, value));
  return value;
}

std::size_t GltfDocument::index(const Json& object, const char* name, const char* into) const {
  const std::size_t value = whole(object, name, std::numeric_limits<std::size_t>::max());
  const std::size_t count = list(into).size();
  if (value >= count) fail(fmt::format("is damaged: {} is not one of the {} {}", name, count, into));
  return value;
}

double GltfDocument::number(const Json& object, const char* name, double otherwise) const {
  const Json* const found = find(object, name);
  if (found == nullptr) return otherwise;
  if (!is_finite_number(*found)) fail(fmt::format("is damaged: {} is not a finite number", name));
  return found->get<double>();
}

bool GltfDocument::flag(const Json& object, const char* name) const {
  const Json* const found = find(object, name);
  return found != nullptr && found->is_boolean() && found->get<bool>();
}

std::string GltfDocument::text(const Json& object, const char* name, const std::string& otherwise) const {
  const Json* const found = find(object, name);
  std::string value = found != nullptr && found->is_string() ? found->get<std::string>() : otherwise;
  std::replace_if(
      value.begin(), value.end(), [](unsigned char c) { return c < 0x20; }, '?');
  return value;
}

std::vector<double> GltfDocument::numbers(const Json& object, const char* name, std::vector<double> otherwise) const {
  const Json* const found = find(object, name);
  if (found == nullptr) return otherwise;
  if (!found->is_array() || found->size() != otherwise.size() ||
      !std::all_of(found->begin(), found->end(), is_finite_number))
    fail(fmt::format("is damaged: {} is not a list of {} finite numbers", name, otherwise.size()));
  return found->get<std::vector<double>>();
}

std::span<const std::byte> GltfDocument::buffer_view(std::size_t index_of_view) const {
  const Json& views = list("bufferViews");
  if (index_of_view >= views.size()) fail("is damaged: it refers to a missing bufferView");
  const Json& view = views[index_of_view];
  return bytes_of(view, fmt::format("bufferView {}", index_of_view));
}

std::span<const std::byte> GltfDocument::bytes_of(const Json& json, const std::string& what) const {
  const std::vector<std::byte>& buffer = buffers_[index(json, "buffer", "buffers")];
  const std::size_t offset = whole(json, "byteOffset", 0), length = whole(json, "byteLength", 0);
  if (offset > buffer.size() || length > buffer.size() - offset)
    fail(fmt::format("is damaged: {} is beyond the end of its buffer", what));
  return {buffer.data() + offset, length};
}

std::size_t GltfDocument::bytes() const {
  std::size_t sum = 0;
  for (const std::vector<std::byte>& buffer : buffers_) sum += buffer.size();
  return sum;
}

std::vector<std::byte> GltfDocument::data_uri(const std::string& uri) const {
  const std::size_t comma = uri.find(',');
  if (comma == std::string::npos || !std::string_view(uri).substr(0, comma).ends_with(";base64"))
    fail("has a data: URI that is not base64");
  return base64_decoded(std::string_view(uri).substr(comma + 1));
}

}  // namespace esim::inline scene
