#include "esim/scene/import/folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdint>

#include "esim/core/error.h"
#include "esim/core/inputs/used_files.h"

namespace esim::inline scene {
namespace {

constexpr std::uintmax_t kMaxFileBytes = std::uintmax_t{1} << 31;

bool has_scheme(const std::string& name) {
  const std::size_t colon = name.find(':');
  return colon != std::string::npos && colon > 1;  // a single letter is a drive
}

bool is_absolute(const std::string& name) { return name.starts_with('/') || (name.size() > 1 && name[1] == ':'); }

}  // namespace

FolderPath path_inside(const std::filesystem::path& folder, std::string name) {
  namespace fs = std::filesystem;
  std::replace(name.begin(), name.end(), '\\', '/');
  if (name.empty() || name.find('\0') != std::string::npos) return {{}, "has no name"};
  if (has_scheme(name)) return {{}, "is a URI; only files are read"};

  std::error_code error;
  const fs::path root = fs::weakly_canonical(folder.empty() ? fs::path(".") : folder, error);
  if (error) return {{}, "cannot be resolved: " + error.message()};
  const fs::path resolved = fs::weakly_canonical(is_absolute(name) ? fs::path(name) : root / name, error);
  const bool inside =
      !error && std::mismatch(root.begin(), root.end(), resolved.begin(), resolved.end()).first == root.end();
  if (inside && !is_absolute(name)) return {resolved, {}};
  const fs::path beside = root / fs::path(name).filename();
  if (fs::is_regular_file(beside, error) && !fs::is_symlink(beside, error)) return {beside, {}};
  return {{}, "is outside the scene's folder; scenes may only read files inside it"};
}

std::string percent_decoded(const std::string& uri) {
  std::string text;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    unsigned char code = 0;
    const char* const digits = uri.data() + i + 1;
    if (uri[i] == '%' && i + 2 < uri.size() && std::from_chars(digits, digits + 2, code, 16).ptr == digits + 2) {
      text += static_cast<char>(code);
      i += 2;
    } else {
      text += uri[i];
    }
  }
  return text;
}

std::vector<std::byte> read_bytes(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) throw UserError(fmt::format("{}: no such file", file.string()));
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error || size > kMaxFileBytes) throw UserError(fmt::format("{}: is larger than 2 GiB; split it", file.string()));
  std::vector<std::byte> bytes(size);
  std::ifstream in = open_input(file);
  if (!in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size)))
    throw UserError(fmt::format("{}: cannot be read; check its permissions", file.string()));
  return bytes;
}

}  // namespace esim::inline scene
