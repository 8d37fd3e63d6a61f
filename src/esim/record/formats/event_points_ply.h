#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "esim/record/output_file.h"
#include "esim/record/record.h"

namespace esim {

/// What one camera's events saw, as a point cloud in binary little-endian PLY, a vertex per event, in their order:
///
///   x y z     float   the point, world frame, m
///   t         double  of the event, s
///   u v       ushort  column and row of the event, px
///   polarity  char    1: brightness rose, -1: it fell
///
/// Events without a point are left out. The header counts the vertices that are in the file whenever write() returns.
class EventPointsPlyWriter final : public Sink {
 public:
  EventPointsPlyWriter(std::filesystem::path path, int camera) : path_(std::move(path)), camera_(camera) {}

  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;
  void end(bool complete) override;

 private:
  std::string header() const;

  std::filesystem::path path_;
  int camera_;
  std::string name_;  // of the camera
  std::uint64_t count_ = 0;
  std::optional<OutputFile> file_;
};

}  // namespace esim
