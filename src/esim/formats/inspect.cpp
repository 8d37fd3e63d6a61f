#include "esim/formats/inspect.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "esim/core/error.h"
#include "esim/files/number_text.h"
#include "esim/formats/formats.h"
#include "esim/formats/hdf5/dsec.h"
#include "esim/formats/recording_folder/recording_folder.h"
#include "esim/recording/recording_directory.h"

namespace esim::inline formats {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxReportBytes = std::size_t{1} << 24;

EventsSummary summarise_hdf5(const fs::path& path, RecordingStatus* status = nullptr) {
  const EventsHdf5Reader reader(path);
  EventsSummary summary;
  summary.width = reader.width();
  summary.height = reader.height();
  summary.events = reader.size();
  if (const auto span = reader.time_span()) {
    summary.first = span->start;
    summary.last = span->end;
  }
  summary.on = reader.count_on();
  if (status != nullptr && reader.complete()) {
    *status = *reader.complete() ? RecordingStatus::complete : RecordingStatus::interrupted;
  }
  return summary;
}

void add(EventSpan events, EventsSummary& summary) {
  if (events.empty()) return;
  if (summary.events == 0) summary.first = events.front().t;
  summary.last = events.back().t;
  summary.events += events.size();
  summary.on += static_cast<std::uint64_t>(
      std::count_if(events.begin(), events.end(), [](const Event& event) { return event.polarity > 0; }));
}

// Inspects a file of any format by reading all of it.
void summarise(Source& source, Inspection& inspection) {
  const RecordingInfo& info = source.info();
  for (const CameraInfo& camera : info.cameras) {
    EventsSummary& summary = inspection.cameras.emplace_back();
    if (info.cameras.size() > 1) summary.camera = camera.name;
    if (camera.model.width > 0) summary.width = camera.model.width, summary.height = camera.model.height;
  }
  while (const Record* record = source.next()) {
    if (const auto* events = std::get_if<EventsRecord>(record)) {
      add(events->events, inspection.cameras[static_cast<std::size_t>(events->camera)]);
    } else {
      ++inspection.others[content_of(*record)];
    }
  }
  inspection.not_read = source.not_read();
}

// Inspects the events of a file, without its other contents.
EventsSummary summarise_events(const fs::path& path) {
  if (format_of(path).name == "dsec") return summarise_hdf5(path);
  Inspection inspection;
  summarise(*open_source(path), inspection);
  return inspection.cameras.front();
}

// Inspects one camera's folder; nothing if it has no events.
std::optional<EventsSummary> summarise_folder(const fs::path& folder, const std::string& camera) {
  const auto path = events_file_in(folder);
  if (!path) return std::nullopt;
  EventsSummary summary;
  try {
    if (has_begun(*path)) summary = summarise_events(*path);
  } catch (const UserError& problem) {
    summary.problem = problem.what();
  }
  summary.camera = camera;
  return summary;
}

void read_report(const fs::path& directory, Inspection& inspection) {
  std::error_code error;
  const std::uintmax_t bytes = fs::file_size(directory / "report.json", error);
  if (error || bytes > kMaxReportBytes) return;
  std::ifstream file(directory / "report.json");
  std::string text(bytes, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));
  const auto report = nlohmann::json::parse(text, nullptr, false);
  if (!report.is_object()) return;
  const auto word = [&](const char* key) {
    const auto entry = report.find(key);
    return entry != report.end() && entry->is_string() ? entry->get<std::string>() : std::string();
  };
  const std::string status = word("status");
  inspection.reason = word("reason");
  if (status == "complete") inspection.status = RecordingStatus::complete;
  if (status == "interrupted") inspection.status = RecordingStatus::interrupted;
  if (status == "running") {
    inspection.status = is_being_written(directory) ? RecordingStatus::running : RecordingStatus::killed;
  }
}

// Links are not followed, so that cycles cannot occur.
FileSize folder_size(const fs::path& folder, const fs::path& name) {
  FileSize total{name / "", 0, 0};
  std::error_code error;
  for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    std::error_code unreadable;
    if (!entry->is_regular_file(unreadable)) continue;
    const std::uintmax_t bytes = entry->file_size(unreadable);
    if (unreadable) continue;
    total.bytes += bytes;
    ++total.files;
  }
  return total;
}

// The files of a folder, by name. Folders of images count as one; those of cameras are listed by file.
void list_files(const fs::path& root, const fs::path& below, std::vector<FileSize>& files) {
  std::error_code error;
  std::vector<fs::path> names;
  for (fs::directory_iterator entry(root / below, error), end; !error && entry != end; entry.increment(error)) {
    names.push_back(below / entry->path().filename());
  }
  std::sort(names.begin(), names.end());
  for (const fs::path& name : names) {
    const fs::file_status status = fs::symlink_status(root / name, error);
    if (fs::is_regular_file(status)) {
      const std::uintmax_t bytes = fs::file_size(root / name, error);
      files.push_back({name, error ? 0 : bytes});
    } else if (fs::is_directory(status) && (is_camera_folder(root / name) || !sensors_in(root / name).empty())) {
      list_files(root, name, files);
    } else if (fs::is_directory(status)) {
      files.push_back(folder_size(root / name, name));
    }
  }
}

/// A folder in the format of another program, if it is one with events.
void inspect_folder_of_others(const fs::path& folder, Inspection& inspection) {
  const Format* const format = find_format_of_others(folder);
  if (format == nullptr) return;
  inspection.format = format->description;
  summarise(*open_source(folder), inspection);
}

Inspection inspect_directory(const fs::path& directory) {
  Inspection inspection;
  inspection.path = directory;
  read_report(directory, inspection);
  list_files(directory, {}, inspection.files);
  if (auto summary = summarise_folder(directory, "")) inspection.cameras.push_back(*std::move(summary));

  std::error_code error;
  std::vector<std::string> cameras;
  for (fs::directory_iterator entry(directory, error), end; !error && entry != end; entry.increment(error)) {
    std::error_code unreadable;
    if (entry->is_directory(unreadable)) cameras.push_back(entry->path().filename().string());
  }
  std::sort(cameras.begin(), cameras.end());
  for (const std::string& camera : cameras) {
    if (auto summary = summarise_folder(directory / camera, camera)) inspection.cameras.push_back(*std::move(summary));
    for (const std::string& sensor : sensors_in(directory / camera)) {
      const std::string name = camera + "/" + sensor;
      if (auto summary = summarise_folder(directory / name, name)) inspection.cameras.push_back(*std::move(summary));
    }
  }
  if (inspection.cameras.empty()) inspect_folder_of_others(directory, inspection);
  if (inspection.cameras.empty() && inspection.format.empty() && inspection.status == RecordingStatus::unknown) {
    throw UserError(directory.string() + " is not a recording: no report.json and no events.h5 inside");
  }
  return inspection;
}

Inspection inspect_file(const fs::path& path) {
  Inspection inspection;
  inspection.path = path;
  const Format& format = format_of(path);
  inspection.format = format.description;
  if (format.name == "dsec") {
    inspection.cameras.push_back(summarise_hdf5(path, &inspection.status));
  } else {
    summarise(*open_source(path), inspection);
  }
  std::error_code error;
  inspection.files.push_back({path.filename(), fs::file_size(path, error)});
  return inspection;
}

std::string with_prefix(double value, double base, const char* unit) {
  constexpr const char* kPrefixes[] = {"", "k", "M", "G", "T"};
  std::size_t prefix = 0;
  for (; value >= 999.5 && prefix + 1 < std::size(kPrefixes); ++prefix) value /= base;
  return fmt::format("{:.{}f} {}{}", value,
                     prefix == 0 || value >= 100 ? 0
                     : value >= 10               ? 1
                                                 : 2,
                     kPrefixes[prefix], unit);
}

const char* status_word(RecordingStatus status) {
  switch (status) {
    case RecordingStatus::complete:
      return "complete";
    case RecordingStatus::interrupted:
      return "interrupted";
    case RecordingStatus::killed:
      return "killed while recording: the last part is missing";
    case RecordingStatus::running:
      return "being recorded now";
    case RecordingStatus::unknown:
      break;
  }
  return "unknown";
}

void describe_events(const EventsSummary& camera, std::string& text) {
  const auto line = [&](const char* label, const std::string& value) {
    if (!value.empty()) text += fmt::format("  {:<12}{}\n", label, value);
  };
  text += camera.camera.empty() ? "events\n" : fmt::format("events of {}\n", camera.camera);
  line("problem", camera.problem);
  if (!camera.problem.empty()) return;
  if (camera.width && camera.height) line("resolution", fmt::format("{} x {} px", *camera.width, *camera.height));
  line("number", grouped(camera.events));
  if (camera.events == 0) return;
  const double percent_on = 100.0 * static_cast<double>(camera.on) / static_cast<double>(camera.events);
  line("ON", fmt::format("{} ({:.1f} %)", grouped(camera.on), percent_on));
  line("OFF", fmt::format("{} ({:.1f} %)", grouped(camera.off()), 100.0 - percent_on));
  line("time", fmt::format("{:.6f} s to {:.6f} s ({:.6f} s)", to_seconds(camera.first), to_seconds(camera.last),
                           to_seconds(camera.last - camera.first)));
  if (camera.mean_rate_hz() == 0) return;
  line("mean rate", with_prefix(camera.mean_rate_hz(), 1000, "ev/s"));
  if (camera.width && camera.height) {
    line("per pixel", fmt::format("{:.3g} ev/s", camera.mean_rate_hz() / *camera.width / *camera.height));
  }
}

}  // namespace

double EventsSummary::mean_rate_hz() const {
  return events > 1 && last > first ? static_cast<double>(events) / to_seconds(last - first) : 0.0;
}

Inspection inspect(const fs::path& path) {
  fs::path found = path.has_filename() || !path.has_relative_path() ? path : path.parent_path();
  std::error_code error;
  if (!fs::exists(found, error) && fs::exists(incomplete_path(found), error)) found = incomplete_path(found);
  require_existing(found);
  return fs::is_directory(found, error) ? inspect_directory(found) : inspect_file(found);
}

std::string describe(const Inspection& inspection) {
  std::string text = fmt::format("{}\n", inspection.path.string());
  if (!inspection.format.empty()) text += fmt::format("  {:<12}{}\n", "format", inspection.format);
  if (inspection.format.empty() || inspection.status != RecordingStatus::unknown)
    text += fmt::format("  {:<12}{}\n", "status", status_word(inspection.status));
  if (!inspection.reason.empty()) text += fmt::format("  {:<12}{}\n", "reason", inspection.reason);
  for (const EventsSummary& camera : inspection.cameras) describe_events(camera, text);
  if (!inspection.others.empty()) text += "also\n";
  for (const auto& [content, count] : inspection.others)
    text += fmt::format("  {:<12}{}\n", grouped(count), describe(content));

  if (!inspection.not_read.empty()) text += "not read\n";
  for (const std::string& other : inspection.not_read) text += fmt::format("  {}\n", other);

  std::size_t width = 0;
  for (const FileSize& file : inspection.files) width = std::max(width, file.name.string().size());
  text += "files\n";
  for (const FileSize& file : inspection.files) {
    text += fmt::format("  {:<{}}  {:>9}", file.name.string(), width,
                        with_prefix(static_cast<double>(file.bytes), 1000, "B"));
    text += file.files == 1 ? "\n" : fmt::format("  in {} files\n", grouped(file.files));
  }
  return text;
}

}  // namespace esim::inline formats
