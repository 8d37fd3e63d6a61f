#pragma once

#include <filesystem>
#include <optional>
#include <utility>

#include "esim/files/output_file.h"
#include "esim/recording/record.h"

namespace esim::inline formats {

/// Poses of the body (T_world_body) in the layout of the TUM RGB-D benchmark: one line `timestamp tx ty tz qx qy qz qw`
/// per pose, seconds with nine decimals, m, Hamilton quaternion.
class PosesTumWriter final : public Sink {
 public:
  explicit PosesTumWriter(std::filesystem::path path) : path_(std::move(path)) {}

  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;
  void end(bool complete) override;

 private:
  std::filesystem::path path_;
  std::optional<OutputFile> file_;
};

}  // namespace esim::inline formats
