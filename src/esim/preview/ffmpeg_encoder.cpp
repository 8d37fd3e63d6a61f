#ifdef ESIM_FFMPEG

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/opt.h>
}

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "esim/files/output_file.h"
#include "esim/preview/palette.h"
#include "esim/preview/video_encoder.h"
#include "esim/preview/yuv.h"

namespace esim::inline preview {
namespace {

struct Deleter {
  void operator()(AVCodecContext* context) const { avcodec_free_context(&context); }
  void operator()(AVFrame* frame) const { av_frame_free(&frame); }
  void operator()(AVPacket* packet) const { av_packet_free(&packet); }
  void operator()(AVFormatContext* context) const {
    if (context->pb != nullptr) avio_closep(&context->pb);
    avformat_free_context(context);
  }
};

template <typename T>
using Owned = std::unique_ptr<T, Deleter>;

std::string reason_of(int error) {
  char text[AV_ERROR_MAX_STRING_SIZE] = {};
  av_strerror(error, text, sizeof text);
  return text;
}

class FFmpegEncoder final : public VideoEncoder {
 public:
  FFmpegEncoder(const std::filesystem::path& path, VideoShape shape, VideoKind kind) : path_(path) {
    av_log_set_level(AV_LOG_QUIET);  // failures become exceptions
    OutputFile(path_).close();       // throws with the reason if the file cannot be created
    open_encoder(kind, shape);
    open_file(kind);
  }

  void append(const Image<Rgb>& image) override {
    check(av_frame_make_writable(frame_.get()));
    fill(image);
    frame_->pts = frames_++;
    encode(frame_.get());
  }

  void close() override {
    encode(nullptr);
    check(av_write_trailer(format_.get()));
    avio_flush(format_->pb);
    check(format_->pb->error);
    check(avio_closep(&format_->pb));
  }

 private:
  /// Returns a result, or throws if it is an error.
  int check(int result) const {
    if (result < 0) throw_cannot_write(path_, reason_of(result));
    return result;
  }

  void open_encoder(VideoKind kind, VideoShape shape);
  void open_file(VideoKind kind);
  void fill(const Image<Rgb>& image);
  void encode(const AVFrame* image);

  std::filesystem::path path_;
  Owned<AVFormatContext> format_;
  Owned<AVCodecContext> encoder_;
  Owned<AVFrame> frame_;
  Owned<AVPacket> packet_;
  AVStream* stream_ = nullptr;  // belongs to format_
  std::int64_t frames_ = 0;
};

void FFmpegEncoder::open_encoder(VideoKind kind, VideoShape shape) {
  const bool gif = kind == VideoKind::gif, compact = kind == VideoKind::compact_mp4;
  const AVCodec* codec = avcodec_find_encoder_by_name(gif ? "gif" : "libx264");
  if (codec == nullptr) {
    throw_cannot_write(
        path_, gif ? "FFmpeg has no GIF encoder" : "FFmpeg has no H.264 encoder (libx264); record without the preview");
  }
  encoder_.reset(avcodec_alloc_context3(codec));
  encoder_->width = shape.width;
  encoder_->height = shape.height;
  encoder_->pix_fmt = gif ? AV_PIX_FMT_PAL8 : AV_PIX_FMT_YUV420P;
  encoder_->time_base = av_inv_q(av_d2q(shape.frames_per_s, 100000));
  encoder_->thread_count = 1;  // gives the same file on every machine, and leaves processors for the simulation
  encoder_->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  if (!gif) {
    // Slower presets at best halve the file, but take three times as long, which would dominate the run time.
    av_opt_set(encoder_->priv_data, "preset", "ultrafast", 0);
    av_opt_set(encoder_->priv_data, "crf", compact ? "23" : "20", 0);
  }
  check(avcodec_open2(encoder_.get(), codec, nullptr));

  frame_.reset(av_frame_alloc());
  frame_->format = encoder_->pix_fmt;
  frame_->width = shape.width;
  frame_->height = shape.height;
  check(av_frame_get_buffer(frame_.get(), 0));
  packet_.reset(av_packet_alloc());
}

void FFmpegEncoder::open_file(VideoKind kind) {
  AVFormatContext* context = nullptr;
  check(avformat_alloc_output_context2(&context, nullptr, kind == VideoKind::gif ? "gif" : "mp4", nullptr));
  format_.reset(context);
  format_->flags |= AVFMT_FLAG_BITEXACT;
  stream_ = avformat_new_stream(format_.get(), nullptr);
  stream_->time_base = encoder_->time_base;
  stream_->avg_frame_rate = av_inv_q(encoder_->time_base);
  check(avcodec_parameters_from_context(stream_->codecpar, encoder_.get()));
  check(avio_open(&format_->pb, ("file:" + path_.string()).c_str(), AVIO_FLAG_WRITE));
  check(avformat_write_header(format_.get(), nullptr));
}

void FFmpegEncoder::fill(const Image<Rgb>& image) {
  if (frame_->format == AV_PIX_FMT_YUV420P) {
    const auto plane = [&](int index) { return BytePlane{frame_->data[index], frame_->linesize[index]}; };
    to_yuv420(image, plane(0), plane(1), plane(2));
    return;
  }
  const PaletteImage reduced = reduce_colours(image);
  for (int y = 0; y < image.height(); ++y)
    std::copy_n(reduced.indices.row(y), image.width(), frame_->data[0] + std::ptrdiff_t{y} * frame_->linesize[0]);
  for (std::size_t i = 0; i < reduced.colours.size(); ++i) {
    const Rgb colour = reduced.colours[i];
    const std::uint32_t opaque =
        0xff000000u | static_cast<std::uint32_t>(colour.r) << 16 | static_cast<std::uint32_t>(colour.g) << 8 | colour.b;
    std::memcpy(frame_->data[1] + sizeof opaque * i, &opaque, sizeof opaque);
  }
}

void FFmpegEncoder::encode(const AVFrame* image) {
  check(avcodec_send_frame(encoder_.get(), image));
  while (true) {
    const int result = avcodec_receive_packet(encoder_.get(), packet_.get());
    if (result == AVERROR(EAGAIN) || result == AVERROR_EOF) return;
    check(result);
    packet_->duration = 1;
    av_packet_rescale_ts(packet_.get(), encoder_->time_base, stream_->time_base);
    check(av_interleaved_write_frame(format_.get(), packet_.get()));
  }
}

}  // namespace

std::unique_ptr<VideoEncoder> make_ffmpeg_encoder(const std::filesystem::path& path, VideoShape shape, VideoKind kind) {
  return std::make_unique<FFmpegEncoder>(path, shape, kind);
}

}  // namespace esim::inline preview

#endif
