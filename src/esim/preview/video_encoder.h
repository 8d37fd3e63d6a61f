#pragma once

#include <filesystem>
#include <memory>

#include "esim/preview/video_file.h"

// Private to preview: what writes each kind of video. Functions throw OutputError.
namespace esim::inline preview {

struct VideoShape {
  int width = 0, height = 0;
  double frames_per_s = 25;
};

class VideoEncoder {
 public:
  VideoEncoder() = default;
  virtual ~VideoEncoder() = default;
  VideoEncoder(const VideoEncoder&) = delete;
  VideoEncoder& operator=(const VideoEncoder&) = delete;

  virtual void append(const Image<Rgb>& image) = 0;
  virtual void close() = 0;
};

/// MP4 and GIF; exists only if ESIM_FFMPEG is defined.
std::unique_ptr<VideoEncoder> make_ffmpeg_encoder(const std::filesystem::path& path, VideoShape shape, VideoKind kind);

std::unique_ptr<VideoEncoder> make_webp_encoder(const std::filesystem::path& path, VideoShape shape);

}  // namespace esim::inline preview
