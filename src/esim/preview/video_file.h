#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "esim/core/image.h"
#include "esim/preview/colours.h"

namespace esim::inline preview {

/// MP4 with H.264 in yuv420p, which browsers play; the same with about a quarter fewer bytes; or an endless GIF with
/// 256 colours per frame.
enum class VideoKind { mp4, compact_mp4, gif };

/// Writes a video. Throws OutputError on failure.
class VideoFile {
 public:
  /// Width and height must be even. Times in GIFs have steps of 1/100 s.
  VideoFile(std::filesystem::path path, int width, int height, double frames_per_s, VideoKind kind = VideoKind::mp4);
  ~VideoFile();

  void append(const Image<Rgb>& image);

  /// Writes the rest, and checks that all frames are in the file.
  void close();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace esim::inline preview
