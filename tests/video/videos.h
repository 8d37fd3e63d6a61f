#pragma once

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

#include <ImfRgbaFile.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "esim/core/image.h"

namespace esim::test {

/// Writes a lossless video (FFV1 in Matroska) whose frames have the given time stamps. `code` is the value of every
/// component of a pixel, with 8 or 16 bits depending on the format.
using Code = std::function<int(int x, int y, int frame)>;
inline void write_video(const std::filesystem::path& path, AVPixelFormat format, int width, int height,
                        const std::vector<std::int64_t>& stamps_ms, const Code& code) {
  const auto check = [](int result) {
    if (result < 0) throw std::runtime_error("libav failed to write a test video");
  };
  AVFormatContext* file = nullptr;
  check(avformat_alloc_output_context2(&file, nullptr, "matroska", path.c_str()));
  const AVCodec* codec = avcodec_find_encoder(AV_CODEC_ID_FFV1);
  AVCodecContext* encoder = avcodec_alloc_context3(codec);
  encoder->width = width, encoder->height = height, encoder->pix_fmt = format;
  encoder->time_base = {1, 1000};
  encoder->strict_std_compliance = FF_COMPLIANCE_EXPERIMENTAL;
  check(avcodec_open2(encoder, codec, nullptr));
  AVStream* stream = avformat_new_stream(file, nullptr);
  stream->time_base = encoder->time_base;
  check(avcodec_parameters_from_context(stream->codecpar, encoder));
  check(avio_open(&file->pb, path.c_str(), AVIO_FLAG_WRITE));
  check(avformat_write_header(file, nullptr));

  AVFrame* frame = av_frame_alloc();
  frame->format = format, frame->width = width, frame->height = height;
  check(av_frame_get_buffer(frame, 0));
  AVPacket* packet = av_packet_alloc();
  const bool deep = format != AV_PIX_FMT_GRAY8;
  for (std::size_t i = 0; i <= stamps_ms.size(); ++i) {
    if (i < stamps_ms.size()) {
      check(av_frame_make_writable(frame));
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          std::uint8_t* row = frame->data[0] + std::ptrdiff_t{y} * frame->linesize[0];
          const int value = code(x, y, static_cast<int>(i));
          if (deep) {
            reinterpret_cast<std::uint16_t*>(row)[x] = static_cast<std::uint16_t>(value);
          } else {
            row[x] = static_cast<std::uint8_t>(value);
          }
        }
      }
      frame->pts = stamps_ms[i];
    }
    check(avcodec_send_frame(encoder, i < stamps_ms.size() ? frame : nullptr));
    while (avcodec_receive_packet(encoder, packet) >= 0) {
      av_packet_rescale_ts(packet, encoder->time_base, stream->time_base);
      check(av_interleaved_write_frame(file, packet));
    }
  }
  check(av_write_trailer(file));
  avio_closep(&file->pb);
  av_packet_free(&packet);
  av_frame_free(&frame);
  avcodec_free_context(&encoder);
  avformat_free_context(file);
}

inline void write_exr(const std::filesystem::path& path, int width, int height,
                      const std::function<float(int x, int y)>& grey) {
  std::vector<Imf::Rgba> pixels;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) pixels.emplace_back(grey(x, y), grey(x, y), grey(x, y));
  }
  Imf::RgbaOutputFile file(path.c_str(), width, height);
  file.setFrameBuffer(pixels.data(), 1, static_cast<std::size_t>(width));
  file.writePixels(height);
}

/// Writes a uniform grey image.
inline void write_png(const std::filesystem::path& path, int width, int height, int code, int type = CV_8UC1) {
  cv::imwrite(path.string(), cv::Mat(height, width, type, cv::Scalar::all(code)));
}

/// A continuous pattern of irradiance without detail finer than 5 px.
class Pattern {
 public:
  explicit Pattern(unsigned seed) {
    std::mt19937 random(seed);
    const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
    for (Wave& wave : waves_) {
      const double length = 5.0 * std::pow(8.0, uniform()), angle = 6.2831853 * uniform();
      wave = {6.2831853 / length * std::cos(angle), 6.2831853 / length * std::sin(angle), 6.2831853 * uniform()};
    }
  }

  double operator()(double x, double y) const {
    double sum = -1.2;
    for (const Wave& wave : waves_) sum += 0.15 * std::sin(wave.x * x + wave.y * y + wave.phase);
    return std::exp(sum);
  }

 private:
  struct Wave {
    double x, y, phase;
  };
  std::array<Wave, 40> waves_;
};

/// A scene: irradiance at a point and a time, in frames.
using Scene = std::function<double(double x, double y, double t)>;

inline Image<float> view(const Scene& scene, int width, int height, double t = 0) {
  Image<float> image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image(x, y) = static_cast<float>(scene(x, y, t));
  }
  return image;
}

}  // namespace esim::test
