#include "esim/preview/video_file.h"

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

}  // namespace

struct VideoFile::Impl {
  std::filesystem::path path;
  Owned<AVFormatContext> format;
  Owned<AVCodecContext> encoder;
  Owned<AVFrame> frame;
  Owned<AVPacket> packet;
  AVStream* stream = nullptr;  // belongs to format
  std::int64_t frames = 0;

  /// Returns a result, or throws if it is an error.
  int check(int result) const {
    if (result < 0) throw_cannot_write(path, reason_of(result));
    return result;
  }

  void open_encoder(VideoKind kind, int width, int height, double frames_per_s);
  void open_file(VideoKind kind);
  void fill(const Image<Rgb>& image);
  void encode(const AVFrame* image);
};

void VideoFile::Impl::open_encoder(VideoKind kind, int width, int height, double frames_per_s) {
  const bool gif = kind == VideoKind::gif, compact = kind == VideoKind::compact_mp4;
  const AVCodec* codec = avcodec_find_encoder_by_name(gif ? "gif" : "libx264");
  if (codec == nullptr) {
    throw_cannot_write(
        path, gif ? "FFmpeg has no GIF encoder" : "FFmpeg has no H.264 encoder (libx264); record without the preview");
  }
  encoder.reset(avcodec_alloc_context3(codec));
  encoder->width = width;
  encoder->height = height;
  encoder->pix_fmt = gif ? AV_PIX_FMT_PAL8 : AV_PIX_FMT_YUV420P;
  encoder->time_base = av_inv_q(av_d2q(frames_per_s, 100000));
  encoder->thread_count = 1;  // gives the same file on every machine, and leaves processors for the simulation
  encoder->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  if (!gif) {
    // Slower presets at best halve the file, but take three times as long, which would dominate the run time.
    av_opt_set(encoder->priv_data, "preset", "ultrafast", 0);
    av_opt_set(encoder->priv_data, "crf", compact ? "23" : "20", 0);
  }
  check(avcodec_open2(encoder.get(), codec, nullptr));

  frame.reset(av_frame_alloc());
  frame->format = encoder->pix_fmt;
  frame->width = width;
  frame->height = height;
  check(av_frame_get_buffer(frame.get(), 0));
  packet.reset(av_packet_alloc());
}

void VideoFile::Impl::open_file(VideoKind kind) {
  AVFormatContext* context = nullptr;
  check(avformat_alloc_output_context2(&context, nullptr, kind == VideoKind::gif ? "gif" : "mp4", nullptr));
  format.reset(context);
  format->flags |= AVFMT_FLAG_BITEXACT;
  stream = avformat_new_stream(format.get(), nullptr);
  stream->time_base = encoder->time_base;
  stream->avg_frame_rate = av_inv_q(encoder->time_base);
  check(avcodec_parameters_from_context(stream->codecpar, encoder.get()));
  check(avio_open(&format->pb, ("file:" + path.string()).c_str(), AVIO_FLAG_WRITE));
  check(avformat_write_header(format.get(), nullptr));
}

void VideoFile::Impl::fill(const Image<Rgb>& image) {
  if (frame->format == AV_PIX_FMT_YUV420P) {
    const auto plane = [&](int index) { return BytePlane{frame->data[index], frame->linesize[index]}; };
    to_yuv420(image, plane(0), plane(1), plane(2));
    return;
  }
  const PaletteImage reduced = reduce_colours(image);
  for (int y = 0; y < image.height(); ++y)
    std::copy_n(reduced.indices.row(y), image.width(), frame->data[0] + std::ptrdiff_t{y} * frame->linesize[0]);
  for (std::size_t i = 0; i < reduced.colours.size(); ++i) {
    const Rgb colour = reduced.colours[i];
    const std::uint32_t opaque =
        0xff000000u | static_cast<std::uint32_t>(colour.r) << 16 | static_cast<std::uint32_t>(colour.g) << 8 | colour.b;
    std::memcpy(frame->data[1] + sizeof opaque * i, &opaque, sizeof opaque);
  }
}

void VideoFile::Impl::encode(const AVFrame* image) {
  check(avcodec_send_frame(encoder.get(), image));
  while (true) {
    const int result = avcodec_receive_packet(encoder.get(), packet.get());
    if (result == AVERROR(EAGAIN) || result == AVERROR_EOF) return;
    check(result);
    packet->duration = 1;
    av_packet_rescale_ts(packet.get(), encoder->time_base, stream->time_base);
    check(av_interleaved_write_frame(format.get(), packet.get()));
  }
}

VideoFile::VideoFile(std::filesystem::path path, int width, int height, double frames_per_s, VideoKind kind)
    : impl_(std::make_unique<Impl>()) {
  av_log_set_level(AV_LOG_QUIET);  // failures become exceptions
  impl_->path = std::move(path);
  OutputFile(impl_->path).close();  // throws with the reason if the file cannot be created
  impl_->open_encoder(kind, width, height, frames_per_s);
  impl_->open_file(kind);
}

VideoFile::~VideoFile() = default;

void VideoFile::append(const Image<Rgb>& image) {
  impl_->check(av_frame_make_writable(impl_->frame.get()));
  impl_->fill(image);
  impl_->frame->pts = impl_->frames++;
  impl_->encode(impl_->frame.get());
}

void VideoFile::close() {
  impl_->encode(nullptr);
  impl_->check(av_write_trailer(impl_->format.get()));
  avio_flush(impl_->format->pb);
  impl_->check(impl_->format->pb->error);
  impl_->check(avio_closep(&impl_->format->pb));
}

}  // namespace esim::inline preview
