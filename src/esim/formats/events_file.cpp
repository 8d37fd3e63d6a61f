#include "esim/formats/events_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "esim/core/error.h"
#include "esim/core/remedy.h"
#include "esim/files/number_text.h"
#include "esim/formats/formats.h"
#include "esim/formats/recording_folder/recording_folder.h"
#include "esim/recording/recording_directory.h"

namespace esim::inline formats {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxFileExtent = 65536;  // px
constexpr std::uintmax_t kMaxEventsReportBytes = std::uintmax_t{1} << 24;

// The events file that a path stands for.
fs::path find_any_file(const fs::path& path) {
  std::error_code error;
  require_existing(path);
  if (!fs::is_directory(path, error)) return path;
  if (const auto file = events_file_in(path)) return *file;

  // The folders of cameras, and of event sensors that share their lenses.
  std::vector<fs::path> cameras;
  for (fs::directory_iterator entry(path, error), end; !error && entry != end; entry.increment(error)) {
    if (events_file_in(entry->path())) cameras.push_back(entry->path());
    std::error_code unreadable;
    if (!entry->is_directory(unreadable)) continue;
    for (const std::string& sensor : sensors_in(entry->path())) cameras.push_back(entry->path() / sensor);
  }
  if (cameras.empty() && find_format_of_others(path) != nullptr) return path;
  if (cameras.empty()) throw UserError(path.string() + ": there is no events.h5 or events.txt inside");
  if (cameras.size() == 1) return *events_file_in(cameras.front());
  std::sort(cameras.begin(), cameras.end());
  std::string names;
  for (const fs::path& camera : cameras)
    names += (names.empty() ? "" : ", ") + camera.lexically_relative(path).string();
  throw UserError(fmt::format("{} holds several cameras ({}): name one, for example {}", path.string(), names,
                              cameras.front().string()));
}

fs::path find_file(const fs::path& path) {
  fs::path file = find_any_file(path);
  if (file.extension() == ".h5" && !has_begun(file)) {
    throw UserError(
        fmt::format("{} holds no events: the program that wrote {} was stopped before the first event; create it again",
                    path.string(), file.filename().string()));
  }
  return file;
}

std::optional<SensorSize> sensor_in_report(const nlohmann::json& report, const std::string& name) {
  const auto& cameras = report.at("cameras");
  for (const auto& camera : cameras) {
    if (cameras.size() > 1 && camera.at("name") != name) continue;
    const SensorSize sensor{camera.at("width").get<int>(), camera.at("height").get<int>()};
    if (std::min(sensor.width, sensor.height) >= 1 && std::max(sensor.width, sensor.height) <= kMaxFileExtent)
      return sensor;
  }
  return std::nullopt;
}

// The sensor size in a recording's report.json: of the camera with this folder, or of the only camera.
std::optional<SensorSize> reported_sensor(const fs::path& folder) {
  for (const fs::path& path : {folder / "report.json", folder.parent_path() / "report.json"}) {
    std::error_code error;
    const std::uintmax_t bytes = fs::file_size(path, error);
    if (error || bytes > kMaxEventsReportBytes) continue;
    try {
      std::ifstream file(path);
      return sensor_in_report(nlohmann::json::parse(file), folder.filename().string());
    } catch (const nlohmann::json::exception&) {  // another program's report
    }
  }
  return std::nullopt;
}

}  // namespace

EventsFile::EventsFile(const fs::path& path, const ReadOptions& options) : path_(find_file(path)) {
  ReadOptions told = options;
  // The sensor size in the file itself takes precedence over the report's.
  source_ = open_source(path_, told);
  const auto size_of = [](const Source& source) { return source.info().cameras.front().model; };
  require_camera(*source_, path_);
  if (source_->info().cameras.size() > 1) {
    std::string names;
    for (const CameraInfo& camera : source_->info().cameras) names += (names.empty() ? "" : ", ") + camera.name;
    throw RemediableError(
        fmt::format("{} holds several cameras ({}): copy one into a file first", path_.string(), names),
        Remedy::extract_camera);
  }
  if (size_of(*source_).width == 0) {
    told.sensor = reported_sensor(path_.parent_path());
    if (told.sensor) source_ = open_source(path_, told);
  }
  const Camera model = size_of(*source_);
  if (model.width > 0) sensor_ = SensorSize{model.width, model.height};
}

bool EventsFile::read(std::vector<Event>& events, std::size_t count) {
  events.clear();
  while (events.size() < count) {
    const std::size_t taken = std::min(count - events.size(), portion_.size());
    events.insert(events.end(), portion_.begin(), portion_.begin() + static_cast<std::ptrdiff_t>(taken));
    portion_ = portion_.subspan(taken);
    if (!portion_.empty()) break;
    const Record* record = source_->next();
    if (record == nullptr) break;
    if (const auto* found = std::get_if<EventsRecord>(record)) portion_ = found->events;
  }
  found_any_ |= !events.empty();
  if (!found_any_ && !source_->not_read().empty()) {
    throw UserError(fmt::format("{} holds no events that can be read; not read: {}", path_.string(),
                                list_of_some(source_->not_read())));
  }
  return !events.empty();
}

}  // namespace esim::inline formats
