#include "esim/studio/file_kinds.h"

#include <algorithm>
#include <array>
#include <string>

#include "esim/files/input_file.h"
#include "esim/formats/formats.h"

namespace esim::studio {
namespace {

namespace fs = std::filesystem;

template <std::size_t N>
bool is_one_of(const std::string& text, const std::array<const char*, N>& all) {
  return std::find(all.begin(), all.end(), text) != all.end();
}

bool is_recording_folder(const fs::path& place) {
  const auto& all = all_formats();
  return std::any_of(all.begin(), all.end(), [&](const Format& format) {
    return format.folder && format.name == "recording" && format.recognises(place, "");
  });
}

/// The extensions of formats with events, except those that other files use too.
bool is_recording_file(const std::string& extension) {
  static constexpr std::array<const char*, 4> kOthers{".txt", ".csv", ".zip", ".npz"};
  const auto& all = all_formats();
  return !is_one_of(extension, kOthers) && std::any_of(all.begin(), all.end(), [&](const Format& format) {
    return !format.folder && format.can_hold(Content::events) &&
           std::count(format.extensions.begin(), format.extensions.end(), extension) > 0;
  });
}

}  // namespace

FileKind kind_of(const fs::path& place) {
  static constexpr std::array<const char*, 11> kScenes{".glb", ".gltf",  ".obj",   ".ply", ".stl", ".fbx",
                                                       ".dae", ".blend", ".splat", ".spz", ".sog"};
  static constexpr std::array<const char*, 8> kImages{".png", ".jpg", ".jpeg", ".webp", ".pgm", ".ppm", ".exr", ".hdr"};
  std::error_code error;
  if (fs::is_directory(place, error)) return is_recording_folder(place) ? FileKind::recording : FileKind::folder;
  const std::string extension = lower_extension(place);
  if (extension == ".yaml" || extension == ".yml") return FileKind::scenario;
  if (is_one_of(extension, kScenes)) return FileKind::scene;
  if (is_one_of(extension, kImages)) return FileKind::image;
  if (extension == ".npz" || is_recording_file(extension)) return FileKind::recording;
  if (extension == ".txt" || extension == ".csv") return FileKind::trajectory;
  return FileKind::other;
}

std::string_view name_of(FileKind kind) {
  switch (kind) {
    case FileKind::folder:
      return "folder";
    case FileKind::scenario:
      return "scenario";
    case FileKind::scene:
      return "scene";
    case FileKind::recording:
      return "recording";
    case FileKind::image:
      return "image";
    case FileKind::trajectory:
      return "trajectory";
    case FileKind::other:
      break;
  }
  return "other";
}

}  // namespace esim::studio
