#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "esim/files/output_file.h"
#include "esim/recording/record.h"

namespace esim::inline formats {

/// The scene points of one camera's events, as a point cloud in binary little-endian PLY with one vertex per event, in
/// their order:
///
///   x y z     float   scene point, world frame, m
///   t         double  time of the event, s
///   u v       ushort  column and row of the event, px
///   polarity  char    1: ON, -1: OFF
///
/// Events without a point are omitted. After each write(), the header has the number of vertices in the file.
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

}  // namespace esim::inline formats
