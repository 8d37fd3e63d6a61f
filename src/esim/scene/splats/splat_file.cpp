#include "esim/scene/splats/splat_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <string>

#include "esim/core/error.h"
#include "esim/files/input_file.h"
#include "esim/scene/splats/splat_list.h"
#include "esim/scene/splats/splat_readers.h"

namespace esim::inline scene {
namespace {

namespace fs = std::filesystem;

enum class Kind { none, ply, dot_splat, spz, gzip, zip, glb, json };

/// By the first bytes, or by the name for .splat.
Kind kind_of(const fs::path& path) {
  const std::string head = read_head(path, 64);
  if (head.starts_with("ply\n") || head.starts_with("ply\r")) return Kind::ply;
  if (head.starts_with("NGSP")) return Kind::spz;
  if (head.starts_with("\x1F\x8B")) return Kind::gzip;
  if (head.starts_with("PK")) return Kind::zip;
  if (head.starts_with("glTF")) return Kind::glb;
  if (lower_extension(path) == ".splat") return Kind::dot_splat;
  const std::size_t first = head.find_first_not_of(" \t\r\n");
  return first != std::string::npos && head[first] == '{' ? Kind::json : Kind::none;
}

/// The JSON of a glTF file, which in a GLB is its first chunk.
std::string json_of(const fs::path& path, Kind kind) {
  constexpr std::size_t kHeader = 20, kLengthAt = 12;
  InputFile file(path);
  std::size_t bytes = file.size();
  if (kind == Kind::glb) {
    const std::span<const std::byte> header = file.read_exactly(kHeader, "its header");
    std::uint32_t length = 0;
    std::memcpy(&length, header.data() + kLengthAt, sizeof length);
    bytes = length;
  }
  const std::span<const std::byte> text = file.read(bytes);
  return {reinterpret_cast<const char*>(text.data()), text.size()};
}

bool is_splat_json(const std::string& json) { return json.find("\"KHR_gaussian_splatting\"") != std::string::npos; }

bool is_splat_kind(const fs::path& path) {
  switch (const Kind kind = kind_of(path)) {
    case Kind::ply:
      return is_splat_ply(path);
    case Kind::dot_splat:
    case Kind::spz:
      return true;
    case Kind::gzip:
      return is_gzip_spz(path);
    case Kind::zip:
      return is_sog_zip(path);
    case Kind::glb:
      return is_splat_json(json_of(path, kind));
    case Kind::json: {
      const std::string json = json_of(path, kind);
      return is_splat_json(json) || is_sog_meta(json);
    }
    case Kind::none:
      break;
  }
  return false;
}

}  // namespace

Splats load_splats(const fs::path& path, const WarningHandler& warn) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) fail_splats(path, "no such file");
  switch (const Kind kind = kind_of(path)) {
    case Kind::ply:
      return read_splat_ply(path, warn);
    case Kind::dot_splat:
      return read_dot_splat(path, warn);
    case Kind::spz:
    case Kind::gzip:
      return read_spz(path, warn);
    case Kind::zip:
      return read_sog_zip(path, warn);
    case Kind::glb:
      return read_splat_gltf(path, warn);
    case Kind::json:
      return is_sog_meta(json_of(path, kind)) ? read_sog_folder(path, warn) : read_splat_gltf(path, warn);
    case Kind::none:
      break;
  }
  fail_splats(
      path, "its format is not supported; convert it to .ply, .spz, .sog, .splat or glTF with KHR_gaussian_splatting");
}

bool is_splat_file(const fs::path& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return false;
  try {
    return is_splat_kind(path);
  } catch (const UserError&) {  // it cannot be read
    return false;
  }
}

}  // namespace esim::inline scene
