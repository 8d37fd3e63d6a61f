#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "esim/core/image.h"
#include "esim/record/preview/colours.h"

namespace esim {

/// An MP4 with H.264 in yuv420p, which browsers play. Throws OutputError if it cannot be written.
class VideoFile {
 public:
  /// Width and height must be even.
  VideoFile(std::filesystem::path path, int width, int height, double frames_per_s);
  ~VideoFile();

  void append(const Image<Rgb>& frame);

  /// Writes the rest, and looks whether all frames are in the file.
  void close();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace esim
