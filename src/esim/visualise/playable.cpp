#include "esim/visualise/playable.h"

#include <fmt/format.h>

#include <algorithm>

#include "esim/core/error.h"
#include "esim/formats/events_file.h"
#include "esim/formats/formats.h"

namespace esim::inline visualise {
namespace {

namespace fs = std::filesystem;

bool is_format(const fs::path& folder) {
  for (const Format& format : all_formats()) {
    if (format.folder && format.recognises && format.recognises(folder, "")) return true;
  }
  return false;
}

}  // namespace

Playable::Playable(const fs::path& path, std::optional<SensorSize> sensor) : path_(path), reading_{sensor, {}} {
  const fs::path normal = path.lexically_normal();
  name_ = (normal.has_filename() ? normal : normal.parent_path()).filename().string();
  std::error_code error;
  const bool folder = fs::is_directory(path_, error);
  if (folder && !is_format(path_)) {
    const EventsFile events(path_, reading_);
    path_ = events.path();
    reading_.sensor = events.sensor();
  } else if (!folder && !reading_.sensor && open()->info().cameras.size() == 1) {
    reading_.sensor = EventsFile(path_, reading_).sensor();  // from a report next to the file, if there is one
  }
}

int Playable::camera(const std::string& name) const {
  std::string names;
  const auto source = open();
  require_camera(*source, path_);
  const auto& cameras = source->info().cameras;
  if (cameras.empty()) throw UserError(fmt::format("{} holds no data of a camera", path_.string()));
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (name.empty() ? cameras.size() == 1 : cameras[i].name == name) return static_cast<int>(i);
    names += (names.empty() ? "" : ", ") + cameras[i].name;
  }
  if (name.empty()) throw UserError(fmt::format("{} holds several cameras; choose one of {}", path_.string(), names));
  throw UserError(fmt::format("{} has no camera {}; choose one of {}", path_.string(), name, names));
}

std::vector<View> views_named(const std::vector<std::string>& names) {
  std::vector<View> views;
  for (const std::string& name : names) {
    if (name == "all") return {};
    std::optional<View> found;
    std::string known = "all";
    for (int i = 0; i < kViews; ++i) {
      const auto view = static_cast<View>(i);
      if (name == name_of(view)) found = view;
      known += fmt::format(", {}", name_of(view));
    }
    if (!found) throw UserError(fmt::format("there is no view {}; choose one of {}", name, known));
    if (std::find(views.begin(), views.end(), *found) == views.end()) views.push_back(*found);
  }
  return views;
}

}  // namespace esim::inline visualise
