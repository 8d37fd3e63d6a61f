#include "esim/record/formats/events_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "esim/core/error.h"
#include "esim/record/number_text.h"

namespace esim {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxExtent = 65536;                                    // px
constexpr TimeNs kMaxTime = std::numeric_limits<TimeNs>::max() / 2;  // differences of times stay representable
constexpr std::uintmax_t kMaxReportBytes = std::uintmax_t{1} << 24;

std::optional<fs::path> events_in(const fs::path& folder) {
  std::error_code error;
  for (const char* name : {"events.h5", "events.txt"}) {
    if (fs::is_regular_file(folder / name, error)) return folder / name;
  }
  return std::nullopt;
}

// The file that a path means.
fs::path find_file(const fs::path& path) {
  std::error_code error;
  if (!fs::exists(path, error)) {
    throw UserError(path.string() + ": " + (error ? error.message() : "no such file or directory"));
  }
  if (!fs::is_directory(path, error)) return path;
  if (const auto file = events_in(path)) return *file;

  std::vector<fs::path> cameras;
  for (fs::directory_iterator entry(path, error), end; !error && entry != end; entry.increment(error)) {
    if (events_in(entry->path())) cameras.push_back(entry->path());
  }
  if (cameras.empty()) throw UserError(path.string() + ": there is no events.h5 or events.txt inside");
  if (cameras.size() == 1) return *events_in(cameras.front());
  std::sort(cameras.begin(), cameras.end());
  std::string names;
  for (const fs::path& camera : cameras) names += (names.empty() ? "" : ", ") + camera.filename().string();
  throw UserError(fmt::format("{} holds several cameras ({}): name one, for example {}", path.string(), names,
                              cameras.front().string()));
}

std::optional<SensorSize> sensor_in_report(const nlohmann::json& report, const std::string& name) {
  const auto& cameras = report.at("cameras");
  for (const auto& camera : cameras) {
    if (cameras.size() > 1 && camera.at("name") != name) continue;
    const SensorSize sensor{camera.at("width").get<int>(), camera.at("height").get<int>()};
    if (std::min(sensor.width, sensor.height) >= 1 && std::max(sensor.width, sensor.height) <= kMaxExtent)
      return sensor;
  }
  return std::nullopt;
}

// What report.json of a recording says about the camera whose folder this is, or about its only one.
std::optional<SensorSize> reported_sensor(const fs::path& folder) {
  for (const fs::path& path : {folder / "report.json", folder.parent_path() / "report.json"}) {
    std::error_code error;
    const std::uintmax_t bytes = fs::file_size(path, error);
    if (error || bytes > kMaxReportBytes) continue;
    try {
      std::ifstream file(path);
      return sensor_in_report(nlohmann::json::parse(file), folder.filename().string());
    } catch (const nlohmann::json::exception&) {  // somebody else's report
    }
  }
  return std::nullopt;
}

}  // namespace

EventsFile::Reader EventsFile::open(const fs::path& path) {
  constexpr std::string_view kHdf5Signature = "\x89HDF\r\n\x1a\n";
  std::array<char, 4096> head{};
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), head.size());
  const std::string_view start(head.data(), static_cast<std::size_t>(file.gcount()));
  if (start.starts_with(kHdf5Signature)) return EventsHdf5Reader(path);
  if (start.find('\0') != std::string_view::npos) {
    throw UserError("cannot read " + path.string() + ": it is neither HDF5 nor lines of text `t x y p`");
  }
  return EventsTextReader(path);
}

EventsFile::EventsFile(const fs::path& path, std::optional<SensorSize> sensor)
    : path_(find_file(path)), reader_(open(path_)), sensor_(sensor) {
  if (sensor_) return;
  if (const auto* hdf5 = std::get_if<EventsHdf5Reader>(&reader_); hdf5 && hdf5->width() && hdf5->height()) {
    sensor_ = SensorSize{*hdf5->width(), *hdf5->height()};
  } else {
    sensor_ = reported_sensor(path_.parent_path());
  }
}

bool EventsFile::read(std::vector<Event>& events, std::size_t count) {
  if (auto* text = std::get_if<EventsTextReader>(&reader_)) {
    text->read(events, count);
  } else {
    events = std::get<EventsHdf5Reader>(reader_).read(done_, count);
  }
  check(events);
  done_ += events.size();
  return !events.empty();
}

void EventsFile::check(const std::vector<Event>& events) {
  const int width = sensor_ ? sensor_->width : kMaxExtent, height = sensor_ ? sensor_->height : kMaxExtent;
  for (std::size_t i = 0; i < events.size(); ++i) {
    const Event& event = events[i];
    if (event.x >= width || event.y >= height) {
      throw UserError(fmt::format("{}: event {} at ({}, {}) is outside the sensor of {} x {} px", path_.string(),
                                  done_ + i, event.x, event.y, width, height));
    }
    if (event.t > kMaxTime || event.t < -kMaxTime) {
      throw UserError(fmt::format("{}: event {} at {:.3g} s, which is no time of a recording", path_.string(),
                                  done_ + i, to_seconds(event.t)));
    }
    if (last_t_ && event.t < *last_t_) {
      std::string at, before;
      append_seconds(at, event.t);
      append_seconds(before, *last_t_);
      throw UserError(fmt::format("{}: event {} at {} s is before event {} at {} s: sort the events by time",
                                  path_.string(), done_ + i, at, done_ + i - 1, before));
    }
    last_t_ = event.t;
  }
}

}  // namespace esim
