#include "esim/preview/video_file.h"

#include "esim/files/output_file.h"
#include "esim/preview/video_encoder.h"

namespace esim::inline preview {
namespace {

std::unique_ptr<VideoEncoder> make_encoder(const std::filesystem::path& path, VideoShape shape, VideoKind kind) {
  if (kind == VideoKind::webp) return make_webp_encoder(path, shape);
#ifdef ESIM_FFMPEG
  return make_ffmpeg_encoder(path, shape, kind);
#else
  throw_cannot_write(path, "this esim was built without FFmpeg, which encodes MP4 and GIF; write a .webp file instead");
#endif
}

}  // namespace

bool can_write([[maybe_unused]] VideoKind kind) {
#ifdef ESIM_FFMPEG
  return true;
#else
  return kind == VideoKind::webp;
#endif
}

VideoFile::VideoFile(const std::filesystem::path& path, int width, int height, double frames_per_s, VideoKind kind)
    : encoder_(make_encoder(path, {width, height, frames_per_s}, kind)) {}

VideoFile::~VideoFile() = default;

void VideoFile::append(const Image<Rgb>& image) { encoder_->append(image); }

void VideoFile::close() { encoder_->close(); }

}  // namespace esim::inline preview
