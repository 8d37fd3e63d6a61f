#include "esim/formats/copy_recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "esim/core/error.h"
#include "esim/core/remedy.h"
#include "esim/files/number_text.h"
#include "esim/formats/formats.h"
#include "esim/recording/adapters.h"
#include "esim/recording/keep_on_failure.h"
#include "esim/recording/recording_directory.h"
#include "esim/recording/recording_file.h"

namespace esim::inline formats {
namespace {

namespace fs = std::filesystem;

std::string names_of(const std::vector<CameraInfo>& cameras) {
  std::string names;
  for (const CameraInfo& camera : cameras) names += (names.empty() ? "" : ", ") + camera.name;
  return names;
}

/// The index of the camera to copy; nothing: all.
std::optional<int> chosen_camera(const RecordingInfo& info, const Format& format, const std::string& name) {
  const auto& cameras = info.cameras;
  if (cameras.empty() && !format.several_cameras)
    throw UserError(fmt::format("{} holds the data of one camera, but the input has no camera", format.name));
  if (name.empty()) {
    if (cameras.size() <= 1 || format.several_cameras) return std::nullopt;
    throw RemediableError(
        fmt::format("{} holds one camera, but the recording has {}: choose one", format.name, names_of(cameras)),
        Remedy::choose_camera);
  }
  const auto found =
      std::find_if(cameras.begin(), cameras.end(), [&](const CameraInfo& camera) { return camera.name == name; });
  if (cameras.empty()) throw UserError(fmt::format("camera {} does not exist: the recording has no camera", name));
  if (found == cameras.end())
    throw UserError(fmt::format("the recording has no camera {}; its cameras are {}", name, names_of(cameras)));
  return static_cast<int>(found - cameras.begin());
}

std::uint64_t size_of(const Record& record) {
  const auto* events = std::get_if<EventsRecord>(&record);
  return events != nullptr ? events->events.size() : 1;
}

std::optional<int> camera_of(const Record& record) {
  return std::visit(
      [](const auto& kind) -> std::optional<int> {
        if constexpr (requires { kind.camera; }) {
          return kind.camera;
        } else {
          return std::nullopt;
        }
      },
      record);
}

class Copy {
 public:
  Copy(Source& from, const Format& format, const fs::path& to, const CopyOptions& options)
      : from_(from),
        format_(format),
        resolution_(format.either_unit && options.write.unit == TimeUnit::us ? kNsPerUs : format.resolution),
        camera_(chosen_camera(from.info(), format, options.camera)),
        to_(format.create(to, options.write)) {
    if (camera_) to_ = std::make_unique<OneCamera>(std::move(to_), *camera_);
    if (options.from_zero) {
      to_ = std::make_unique<FromZero>(std::move(to_));
      shift_ = from.info().start;
    }
  }

  /// Sets `began` as soon as there is a record to write.
  CopySummary run(const std::function<bool(double)>& go_on, bool& began) {
    to_->begin(from_.info());
    while (const Record* record = next()) {
      began = true;
      take(*record);
      if (!go_on(from_.progress())) {
        summary_.complete = false;
        break;
      }
    }
    to_->end(summary_.complete);
    summary_.not_read = from_.not_read();
    return summary_;
  }

 private:
  /// If reading fails, the target is ended as incomplete. (If writing fails, it is left as it is.)
  const Record* next() {
    try {
      return from_.next();
    } catch (const UserError&) {
      to_->end(false);
      throw;
    }
  }

  void take(const Record& record) {
    const Content content = content_of(record);
    const std::optional<int> camera = camera_of(record);
    if (camera_ && camera && camera != camera_) return;
    const bool held = format_.can_hold(content);
    (held ? summary_.copied : summary_.left_out)[content] += size_of(record);
    if (!held) return;
    if (const auto* events = std::get_if<EventsRecord>(&record)) {
      if (events->events.empty()) return;
      if (!events->labels.empty()) {
        const bool labelled = format_.can_hold(Content::event_labels);
        (labelled ? summary_.copied : summary_.left_out)[Content::event_labels] += events->labels.size();
      }
      note_rounding(*events);
    }
    to_->write(record);
  }

  void note_rounding(const EventsRecord& record) {
    if (resolution_ <= 1 || summary_.rounded_to > 0) return;
    const auto any_off = [&](auto resolution) {
      return std::any_of(record.events.begin(), record.events.end(),
                         [&](const Event& event) { return (event.t - shift_) % resolution != 0; });
    };
    using Us = std::integral_constant<TimeNs, kNsPerUs>;  // division by a constant is faster
    if (resolution_ == kNsPerUs ? any_off(Us()) : any_off(resolution_)) summary_.rounded_to = resolution_;
  }

  Source& from_;
  const Format& format_;
  TimeNs resolution_;
  std::optional<int> camera_;
  std::unique_ptr<Sink> to_;
  TimeNs shift_ = 0;
  CopySummary summary_;
};

/// The report.json that makes a folder, with the files of its format, recognisable as a recording.
std::string conversion_report(const RecordingInfo& info, const std::string& from, bool complete,
                              const std::function<std::map<std::string, std::string>()>& further) {
  auto cameras = nlohmann::ordered_json::array();
  for (const CameraInfo& camera : info.cameras) {
    if (camera.lens >= 0) continue;
    cameras.push_back({{"name", camera.name}, {"width", camera.model.width}, {"height", camera.model.height}});
  }
  nlohmann::ordered_json report = {{"status", complete ? "complete" : "interrupted"}, {"converted_from", from}};
  if (info.start_known) {
    report["start_s"] = to_seconds(info.start);
    report["simulated_s"] = to_seconds(info.end - info.start);
  }
  report["cameras"] = cameras;
  if (further) {
    for (const auto& [name, json] : further()) report[name] = nlohmann::ordered_json::parse(json);
  }
  return report.dump(2) + "\n";
}

std::string written_formats() {
  std::string names;
  for (const Format& format : all_formats()) {
    if (format.create) names += (names.empty() ? "" : ", ") + format.name;
  }
  return names;
}

}  // namespace

CopySummary copy_recording(Source& from, const Format& format, const fs::path& to, const CopyOptions& options,
                           const std::function<bool(double)>& go_on) {
  bool began = false;
  return Copy(from, format, to, options).run(go_on, began);
}

CopySummary convert_recording(const fs::path& from, const Format& format, const fs::path& to,
                              const ConvertOptions& options, const std::function<bool(double)>& go_on) {
  if (!format.create)
    throw UserError(
        fmt::format("format {} can be read but not written; choose one of {}", format.name, written_formats()));
  bool damaged = false;
  ReadOptions reading = options.read;
  if (options.read.recover) {
    reading.recover = [&](const std::string& problem) {
      damaged = true;
      options.read.recover(problem);
    };
  }
  std::unique_ptr<Source> source = open_source(from, reading);
  if (options.change) source = options.change(std::move(source));
  if (!format.can_hold(Content::imu) && !format.can_hold(Content::poses)) require_camera(*source, from);
  bool copied = false;
  const auto copy_to = [&](const fs::path& path) {
    try {
      CopySummary summary = Copy(*source, format, path, options.copy).run(go_on, copied);
      summary.complete &= !damaged;
      if (summary.complete && summary.copied.empty() && summary.left_out.empty() && !summary.not_read.empty()) {
        throw UserError(fmt::format("cannot convert {}: it holds only data that cannot be read: {}", from.string(),
                                    list_of_some(summary.not_read)));
      }
      return summary;
    } catch (const OutputError&) {
      throw;
    } catch (const UserError&) {
      copied = false;  // the input is damaged or does not fit into the format: both have a remedy, so nothing is kept
      throw;
    }
  };
  if (format.folder) {
    RecordingDirectory directory(to, options.replace);
    return keep_on_failure(directory, copied, [&] {
      const CopySummary summary = copy_to(directory.path());
      directory.finish(conversion_report(source->info(), from.string(), summary.complete, options.report));
      return summary;
    });
  }
  RecordingFile file(to, options.replace);
  return keep_on_failure(file, copied, [&] {
    const CopySummary summary = copy_to(file.path());
    file.finish();
    return summary;
  });
}

std::vector<Loss> losses(const CopySummary& summary, const Format& format) {
  std::vector<Loss> losses;
  for (const auto& [content, count] : summary.left_out) {
    losses.push_back({fmt::format("{} cannot hold {}: {} left out", format.name, describe(content), grouped(count))});
  }
  if (!summary.not_read.empty()) losses.push_back({"not read: " + list_of_some(summary.not_read)});
  if (summary.rounded_to > 0) {
    losses.push_back({fmt::format("event times are rounded down to {} us",
                                  static_cast<double>(summary.rounded_to) / static_cast<double>(kNsPerUs)),
                      format.either_unit ? Remedy::nanoseconds : Remedy::none});
  }
  return losses;
}

}  // namespace esim::inline formats
