#pragma once

#include <filesystem>
#include <optional>
#include <utility>

#include "esim/core/image.h"
#include "esim/formats/images/timed_files.h"
#include "esim/recording/record.h"

namespace esim::inline formats {

/// Irradiance images of one camera, from videos and ground truth, as 8-bit grey PNG, sRGB-encoded: 000000.png and so on
/// in a folder, with timestamps.txt: lines `index t_s file`. Of two images at the same time, the first is written.
class ImagesPngWriter final : public Sink {
 public:
  ImagesPngWriter(std::filesystem::path folder, int camera) : folder_(std::move(folder)), camera_(camera) {}

  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;
  void end(bool complete) override;

 private:
  void write(TimeNs t, const Image<float>& irradiance);

  std::filesystem::path folder_;
  int camera_;
  std::optional<TimeNs> last_;  // time of the last image
  std::optional<TimedFilesWriter> files_;
};

}  // namespace esim::inline formats
