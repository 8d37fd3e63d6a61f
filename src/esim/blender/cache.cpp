#include <fmt/format.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <vector>

#include "esim/blender/blender.h"
#include "esim/blender/scripts.h"
#include "esim/core/error.h"
#include "esim/core/inputs/used_files.h"

namespace esim::inline blender {
namespace {

namespace fs = std::filesystem;

/// FNV-1a with 128 bits, for file names by content. Users cannot gain from collisions in their own cache.
class ContentHash {
 public:
  void add(const char* data, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) state_ = (state_ ^ static_cast<unsigned char>(data[i])) * kPrime;
  }

  std::string text() const {
    return fmt::format("{:016x}{:016x}", static_cast<std::uint64_t>(state_ >> 64), static_cast<std::uint64_t>(state_));
  }

 private:
  __extension__ using Wide = unsigned __int128;
  static constexpr Wide kPrime = Wide{1} << 88 | 0x13B;
  Wide state_ = Wide{0x6c62272e07bb0142} << 64 | 0x62b821756295c58d;
};

std::string hash_of(const fs::path& blend) {
  std::ifstream file = open_input(blend);
  if (!file) throw UserError(fmt::format("scene {}: no such file, or no permission to read it", blend.string()));
  ContentHash hash;
  std::string buffer(1 << 20, '\0');
  while (file.read(buffer.data(), static_cast<std::streamsize>(buffer.size())) || file.gcount() > 0)
    hash.add(buffer.data(), static_cast<std::size_t>(file.gcount()));
  for (const std::string& part : {std::string(kCommonScript), std::string(kExportScript), fs::absolute(blend).string()})
    hash.add(part.data(), part.size());
  return hash.text();
}

/// The state of a file to which a scene refers: size and time of the last change; "absent" if it does not exist.
std::string state_of(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return "absent";
  return fmt::format("{} {}", fs::file_size(file, error), fs::last_write_time(file, error).time_since_epoch().count());
}

/// The files in the list of a cached scene; nothing if the list is missing or a file has changed. The list has lines
/// "STATE<tab>PATH".
std::optional<std::vector<std::string>> unchanged_files(const fs::path& list) {
  std::ifstream file(list);
  if (!file) return std::nullopt;
  std::vector<std::string> files;
  for (std::string line; std::getline(file, line);) {
    const std::size_t tab = line.find('\t');
    if (tab == std::string::npos || state_of(line.substr(tab + 1)) != line.substr(0, tab)) return std::nullopt;
    files.push_back(line.substr(tab + 1));
  }
  return files;
}

/// Tells listeners of the files that Blender read for a scene, as far as they exist.
void note_files(const std::vector<std::string>& files) {
  std::error_code error;
  for (const fs::path file : files) {
    if (fs::is_regular_file(file, error)) note_used(file);
  }
}

}  // namespace

fs::path cache_folder() {
  const auto variable = [](const char* name) {
    const char* const value = std::getenv(name);
    return fs::path(value != nullptr ? value : "");
  };
  fs::path base = variable("XDG_CACHE_HOME");
  if (!base.is_absolute()) base = variable("HOME").empty() ? fs::path() : variable("HOME") / ".cache";
  if (base.empty())
    throw UserError("the cache has no folder, since neither HOME nor XDG_CACHE_HOME is set; set XDG_CACHE_HOME");
  std::error_code error;
  fs::create_directories(base / "esim", error);
  if (error)
    throw OutputError(fmt::format("cannot create the folder {}: {}; set XDG_CACHE_HOME to another one",
                                  (base / "esim").string(), error.message()));
  return base / "esim";
}

fs::path cached_glb(const fs::path& blend, const BlenderWatch& watch) {
  const std::string hash = hash_of(blend);
  const fs::path folder = cache_folder();
  const fs::path glb = folder / (hash + ".glb"), list = folder / (hash + ".files");
  std::error_code error;
  if (const auto unchanged = unchanged_files(list); unchanged && fs::is_regular_file(glb, error)) {
    note_files(*unchanged);
    return glb;
  }

  // The exporter reports the files to which the scene refers. Without their list, the cached scene is not used.
  std::vector<std::string> files;
  BlenderWatch listening = watch;
  listening.warning = [&](const std::string& text) {
    constexpr std::string_view kFile = "file ";
    if (text.starts_with(kFile)) return files.push_back(text.substr(kFile.size()));
    watch.warning(text);
  };
  fs::remove(list, error);
  if (!export_blend(blend, glb, listening)) throw UserError(fmt::format("scene {}: interrupted", blend.string()));
  const fs::path draft = folder / fmt::format("{}.files.{}", hash, ::getpid());
  std::ofstream out(draft);
  for (const std::string& file : files) out << state_of(file) << '\t' << file << '\n';
  out.close();
  if (!out) throw OutputError(fmt::format("cannot write {}; is the disk full?", draft.string()));
  fs::rename(draft, list, error);
  note_files(files);
  return glb;
}

}  // namespace esim::inline blender
