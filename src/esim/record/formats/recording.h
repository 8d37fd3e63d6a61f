#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "esim/record/format.h"

namespace esim {

/// A recording's folder, as `esim simulate` writes it, or that of one of its cameras.
Format recording_format();

/// Is it the folder of a camera, by the names of its files?
bool is_camera_folder(const std::filesystem::path& folder);

/// Writes any records as such a folder: the calibration where the intrinsics are known, then each file when the first
/// record comes that belongs into it, and report.json at the end. Points of events come with the events themselves.
class RecordingWriter final : public Sink {
 public:
  RecordingWriter(std::filesystem::path folder, const WriteOptions& options)
      : folder_(std::move(folder)), options_(options) {}

  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;
  void end(bool complete) override;

 private:
  /// The sink of that content, and of the record's camera.
  Sink& sink_of(Content content, const Record& record);
  std::unique_ptr<Sink> make_sink(Content content, const Record& record);

  std::filesystem::path folder_;
  WriteOptions options_;
  RecordingInfo info_;
  TimeNs end_ = 0;
  std::map<std::pair<Content, int>, std::unique_ptr<Sink>> sinks_;                      // by camera; of none: -1
  std::map<int, std::pair<std::optional<TimeNs>, std::optional<TimeNs>>> truth_times_;  // of each camera's last two
};

}  // namespace esim
