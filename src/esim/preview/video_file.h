#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "esim/core/image.h"
#include "esim/preview/colours.h"

namespace esim::inline preview {

/// MP4 with H.264 in yuv420p, which browsers play; the same with about a quarter fewer bytes; an endless GIF with 256
/// colours per frame; or an endless animated WebP, which browsers and image viewers play.
enum class VideoKind { mp4, compact_mp4, gif, webp };

/// Whether this build writes such videos: without FFmpeg, only WebP.
bool can_write(VideoKind kind);

class VideoEncoder;

/// Writes a video. Throws OutputError on failure.
class VideoFile {
 public:
  /// Width and height must be even. Times in GIFs have steps of 1/100 s, those in WebP files 1/1000 s.
  VideoFile(const std::filesystem::path& path, int width, int height, double frames_per_s,
            VideoKind kind = VideoKind::mp4);
  ~VideoFile();

  void append(const Image<Rgb>& image);

  /// Writes the rest, and checks that all frames are in the file.
  void close();

 private:
  std::unique_ptr<VideoEncoder> encoder_;
};

}  // namespace esim::inline preview
