#include "esim/record/preview/video_file.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/opt.h>
}

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "esim/record/output_file.h"
#include "esim/record/preview/palette.h"

namespace esim {
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

/// Rows of an image of even size as Y, and of a pair of them as U and V, in the range of ITU-R BT.601: Y from 16 to
/// 235, U and V from 16 to 240.
void fill_planes(const Image<Rgb>& image, const AVFrame& frame) {
  constexpr int kBits = 15, kHalf = 1 << (kBits - 1);
  const auto fixed = [](double factor) { return static_cast<int>(factor * (1 << kBits) + (factor < 0 ? -0.5 : 0.5)); };
  constexpr double kRed = 0.299, kBlue = 0.114, kGreen = 1 - kRed - kBlue, kLuma = 219.0 / 255, kChroma = 112.0 / 255;
  const int y_r = fixed(kLuma * kRed), y_g = fixed(kLuma * kGreen), y_b = fixed(kLuma * kBlue);
  const int u_r = fixed(-kChroma * kRed / (1 - kBlue)), u_g = fixed(-kChroma * kGreen / (1 - kBlue));
  const int v_g = fixed(-kChroma * kGreen / (1 - kRed)), v_b = fixed(-kChroma * kBlue / (1 - kRed));
  const int u_b = fixed(kChroma), v_r = fixed(kChroma);
  const auto row_of = [&](int plane, int y) { return frame.data[plane] + std::ptrdiff_t{y} * frame.linesize[plane]; };

  for (int y = 0; y < image.height(); ++y) {
    const Rgb* const from = image.row(y);
    std::uint8_t* const luma = row_of(0, y);
#pragma omp simd
    for (int x = 0; x < image.width(); ++x) {
      const int sum = y_r * from[x].r + y_g * from[x].g + y_b * from[x].b;
      luma[x] = static_cast<std::uint8_t>((sum + (16 << kBits) + kHalf) >> kBits);
    }
  }
  const auto components = static_cast<std::size_t>(3 * image.width());
  std::vector<std::uint16_t> pair(components);  // sums over two rows
  for (int y = 0; y + 1 < image.height(); y += 2) {
    const std::uint8_t *const upper = &image.row(y)->r, *const lower = &image.row(y + 1)->r;
#pragma omp simd
    for (std::size_t i = 0; i < components; ++i) pair[i] = static_cast<std::uint16_t>(upper[i] + lower[i]);
    std::uint8_t *const u = row_of(1, y / 2), *const v = row_of(2, y / 2);
    const std::uint16_t* from = pair.data();
    for (int x = 0; x < image.width() / 2; ++x, from += 6) {
      const int red = from[0] + from[3], green = from[1] + from[4], blue = from[2] + from[5];
      constexpr int kMiddle = (128 << (kBits + 2)) + (kHalf << 2);
      u[x] = static_cast<std::uint8_t>((u_r * red + u_g * green + u_b * blue + kMiddle) >> (kBits + 2));
      v[x] = static_cast<std::uint8_t>((v_r * red + v_g * green + v_b * blue + kMiddle) >> (kBits + 2));
    }
  }
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

  /// Passes a result on unless it is an error.
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
  encoder->thread_count = 1;  // the same file on every machine, and processors left for the simulation
  encoder->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  if (!gif) {
    av_opt_set(encoder->priv_data, "preset", compact ? "veryfast" : "ultrafast", 0);
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
  if (frame->format == AV_PIX_FMT_YUV420P) return fill_planes(image, *frame);
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
  av_log_set_level(AV_LOG_QUIET);  // what fails becomes an exception
  impl_->path = std::move(path);
  OutputFile(impl_->path).close();  // says why, if the file cannot be created
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

}  // namespace esim
