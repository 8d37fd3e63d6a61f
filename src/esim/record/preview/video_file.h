#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "esim/core/image.h"
#include "esim/record/preview/colours.h"

namespace esim {

/// MP4 with H.264 in yuv420p, which browsers play, or the same of about a quarter less bytes; or a GIF that repeats for
/// ever, with 256 colours for each frame.
enum class VideoKind { mp4, compact_mp4, gif };

/// A video being written. Throws OutputError if it cannot be.
class VideoFile {
 public:
  /// Width and height must be even. GIFs know times in 1/100 s.
  VideoFile(std::filesystem::path path, int width, int height, double frames_per_s, VideoKind kind = VideoKind::mp4);
  ~VideoFile();

  void append(const Image<Rgb>& image);

  /// Writes the rest, and looks whether all frames are in the file.
  void close();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace esim
