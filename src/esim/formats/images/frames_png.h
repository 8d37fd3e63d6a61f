#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <utility>

#include "esim/files/output_file.h"
#include "esim/recording/record.h"

namespace esim::inline formats {

/// Frames of one camera as grey PNG: frames/000000.png and so on in a folder, with frames.csv: lines
/// `index,t_ns,exposure_ns,gain,exposure_start_ns,bits`, where t_ns is the middle of the exposure (of the middle row)
/// and the start is that of the first row. Digital numbers of 8 bits are written to 8-bit files, larger ones to 16-bit
/// files. With `in_colour`, numbers of an RGGB mosaic become colour PNG.
class FramesPngWriter final : public Sink {
 public:
  FramesPngWriter(std::filesystem::path folder, int camera, bool in_colour = false)
      : folder_(std::move(folder)), camera_(camera), in_colour_(in_colour) {}

  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;
  void end(bool complete) override;

 private:
  std::filesystem::path folder_;
  int camera_;
  bool in_colour_;
  std::int64_t count_ = 0;
  std::optional<OutputFile> list_;
};

}  // namespace esim::inline formats
