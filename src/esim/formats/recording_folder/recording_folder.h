#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "esim/recording/format.h"

namespace esim::inline formats {

/// The format of a recording's folder, as `esim simulate` writes it, or of the folder of one of its cameras.
Format recording_format();

/// Whether it is the folder of a camera, by the names of its files.
bool is_camera_folder(const std::filesystem::path& folder);

/// The event sensors that share the lens of a camera: the subfolders of its folder that have events.
std::vector<std::string> sensors_in(const std::filesystem::path& folder);

/// Writes any records as such a folder: the calibration if the intrinsics are known, each file when its first record
/// comes, and report.json at the end. Event points are written with the events.
class RecordingWriter final : public Sink {
 public:
  RecordingWriter(std::filesystem::path folder, const WriteOptions& options)
      : folder_(std::move(folder)), options_(options) {}

  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;
  void end(bool complete) override;

 private:
  /// The sink for the content and camera of a record.
  Sink& sink_of(Content content, const Record& record);
  std::unique_ptr<Sink> make_sink(Content content, const Record& record);

  std::filesystem::path folder_;
  WriteOptions options_;
  RecordingInfo info_;
  TimeNs end_ = 0;
  std::map<std::pair<Content, int>, std::unique_ptr<Sink>> sinks_;  // by camera; -1: no camera
  std::map<int, std::pair<std::optional<TimeNs>, std::optional<TimeNs>>>
      truth_times_;  // of the last two frames of each camera
};

}  // namespace esim::inline formats
