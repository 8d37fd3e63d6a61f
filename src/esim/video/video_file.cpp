#ifdef ESIM_FFMPEG
extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
}

#include <fmt/format.h>

#include <algorithm>

#include "esim/core/error.h"
#include "esim/core/inputs/used_files.h"
#include "esim/video/frame_source.h"

namespace esim::inline video {
namespace {

struct Deleter {
  void operator()(AVFormatContext* context) const { avformat_close_input(&context); }
  void operator()(AVCodecContext* context) const { avcodec_free_context(&context); }
  void operator()(AVFrame* frame) const { av_frame_free(&frame); }
  void operator()(AVPacket* packet) const { av_packet_free(&packet); }
  void operator()(SwsContext* context) const { sws_freeContext(context); }
};

template <typename T>
using Owned = std::unique_ptr<T, Deleter>;

std::string reason_of(int error) {
  char text[AV_ERROR_MAX_STRING_SIZE] = {};
  av_strerror(error, text, sizeof text);
  return text;
}

/// A file and its video stream; the packets of other streams are skipped.
struct Demuxer {
  explicit Demuxer(const std::filesystem::path& path) {
    const auto check = [&](int result, const char* what) {
      if (result < 0) throw UserError(fmt::format("{}: {}: {}", path.string(), what, reason_of(result)));
    };
    note_used(path);
    AVFormatContext* context = nullptr;
    check(avformat_open_input(&context, ("file:" + path.string()).c_str(), nullptr, nullptr),
          "is not a readable video, or is cut off");
    format.reset(context);
    check(avformat_find_stream_info(context, nullptr), "cannot be read as a video");
    const int best = av_find_best_stream(context, AVMEDIA_TYPE_VIDEO, -1, -1, &codec, 0);
    check(best, "holds no video that FFmpeg's libraries decode");
    stream = context->streams[best];
    for (unsigned i = 0; i < context->nb_streams; ++i) {
      if (static_cast<int>(i) != best) context->streams[i]->discard = AVDISCARD_ALL;
    }
  }

  /// Reads the next packet of the stream; returns libav's error code on failure.
  int read(AVPacket* packet) const {
    while (true) {
      av_packet_unref(packet);
      const int result = av_read_frame(format.get(), packet);
      if (result < 0 || packet->stream_index == stream->index) return result;
    }
  }

  bool has_stamps() const { return (format->iformat->flags & AVFMT_NOTIMESTAMPS) == 0; }
  TimeNs to_ns(std::int64_t stamp) const { return av_rescale_q(stamp, stream->time_base, {1, kNsPerSecond}); }

  Owned<AVFormatContext> format;
  const AVCodec* codec = nullptr;
  AVStream* stream = nullptr;  // owned by format
};

/// The time stamps of all packets: reads the whole file once without decoding it.
FrameSource::Listing list_frames(const Demuxer& demuxer) {
  FrameSource::Listing listing;
  const Owned<AVPacket> packet(av_packet_alloc());
  bool stamped = demuxer.has_stamps();
  while (demuxer.read(packet.get()) >= 0) {
    if ((packet->flags & AV_PKT_FLAG_DISCARD) != 0) continue;
    ++listing.frames;
    const std::int64_t stamp = packet->pts != AV_NOPTS_VALUE ? packet->pts : packet->dts;
    stamped = stamped && stamp != AV_NOPTS_VALUE;
    if (stamped) listing.stamps.push_back(demuxer.to_ns(stamp));
  }
  if (!stamped) {
    listing.stamps.clear();
    return listing;
  }
  // Packets are in the order of decoding.
  std::sort(listing.stamps.begin(), listing.stamps.end());
  listing.stamps.erase(std::unique(listing.stamps.begin(), listing.stamps.end()), listing.stamps.end());
  listing.frames = listing.stamps.size();
  return listing;
}

/// Whether the pixel values use the full range, as in photographs, or the limited range of television.
bool is_full_range(const AVFrame& frame) {
  if (frame.color_range != AVCOL_RANGE_UNSPECIFIED) return frame.color_range == AVCOL_RANGE_JPEG;
  return av_pix_fmt_desc_get(static_cast<AVPixelFormat>(frame.format))->nb_components < 3;
}

class VideoFileSource final : public FrameSource {
 public:
  VideoFileSource(const std::filesystem::path& path, Encoding encoding, bool colour)
      : path_(path),
        encoding_(encoding),
        colour_(colour),
        listing_(list_frames(Demuxer(path))),
        demuxer_(path),
        packet_(av_packet_alloc()),
        frame_(av_frame_alloc()),
        converted_(av_frame_alloc()) {
    decoder_.reset(avcodec_alloc_context3(demuxer_.codec));
    int result = avcodec_parameters_to_context(decoder_.get(), demuxer_.stream->codecpar);
    decoder_->pkt_timebase = demuxer_.stream->time_base;
    if (result >= 0) result = avcodec_open2(decoder_.get(), demuxer_.codec, nullptr);
    if (result < 0) throw UserError(fmt::format("{}: cannot be decoded: {}", path.string(), reason_of(result)));
  }

  const Listing& listing() const override { return listing_; }

  bool advance() override {
    ++count_;
    while (true) {
      const int result = avcodec_receive_frame(decoder_.get(), frame_.get());
      if (result == 0) {
        if ((frame_->flags & AV_FRAME_FLAG_CORRUPT) != 0 || frame_->decode_error_flags != 0) fail("is damaged");
        return true;
      }
      if (result == AVERROR_EOF) {
        if (!failure_.empty()) fail(failure_);
        return false;
      }
      if (result != AVERROR(EAGAIN)) fail(reason_of(result));
      feed();
    }
  }

  std::optional<TimeNs> stamp() const override {
    if (listing_.stamps.empty() || frame_->best_effort_timestamp == AV_NOPTS_VALUE) return std::nullopt;
    return demuxer_.to_ns(frame_->best_effort_timestamp);
  }

  void read(Planes& planes) override {
    const bool deep = convert();
    decode({.data = converted_->data[0],
            .row_bytes = converted_->linesize[0],
            .width = converted_->width,
            .height = converted_->height,
            .channels = 3,
            .type = deep ? PixelType::uint16 : PixelType::uint8},
           encoding_of_frame(), colour_, planes);
  }

  std::string name() const override { return fmt::format("frame {}", count_ - 1); }

 private:
  /// Passes the next packet to the decoder. After an error no more packets follow, and the decoder is flushed.
  void feed() {
    int result = demuxer_.read(packet_.get());
    if (result == AVERROR_EOF && is_cut_off()) {
      failure_ = "is missing: the file is cut off";
    } else if (result < 0 && result != AVERROR_EOF) {
      failure_ = fmt::format("cannot be read: {}", reason_of(result));
    } else if (result >= 0 && (packet_->flags & AV_PKT_FLAG_CORRUPT) != 0) {
      failure_ = "is damaged";
    } else if (result >= 0) {
      ++packets_;
      const std::int64_t stamp = packet_->pts != AV_NOPTS_VALUE ? packet_->pts : packet_->dts;
      if (stamp != AV_NOPTS_VALUE) read_until_ = std::max(read_until_, demuxer_.to_ns(stamp + packet_->duration));
      result = avcodec_send_packet(decoder_.get(), packet_.get());
      if (result < 0) failure_ = fmt::format("cannot be decoded: {}", reason_of(result));
    }
    if (result < 0 || !failure_.empty()) avcodec_send_packet(decoder_.get(), nullptr);
  }

  /// Whether the file ends earlier than its index or header states.
  bool is_cut_off() const {
    if (packets_ < avformat_index_get_entries_count(demuxer_.stream)) return true;
    const AVFormatContext& format = *demuxer_.format;
    if (format.nb_streams > 1 || format.duration_estimation_method != AVFMT_DURATION_FROM_STREAM) return false;
    const TimeNs promised = av_rescale_q(format.start_time + format.duration, AV_TIME_BASE_Q, {1, kNsPerSecond});
    return format.duration > 0 && read_until_ < promised - kNsPerSecond / 2;
  }

  /// Converts the frame to RGB, with 16 bits per channel if it has more than 8; returns whether it has.
  bool convert() {
    const auto format = static_cast<AVPixelFormat>(frame_->format);
    const bool deep = av_pix_fmt_desc_get(format)->comp[0].depth > 8;
    const AVPixelFormat wanted = deep ? AV_PIX_FMT_RGB48 : AV_PIX_FMT_RGB24;
    converter_.reset(sws_getCachedContext(
        converter_.release(), frame_->width, frame_->height, format, frame_->width, frame_->height, wanted,
        SWS_BILINEAR | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INT | SWS_FULL_CHR_H_INP | SWS_BITEXACT, nullptr, nullptr,
        nullptr));
    if (!converter_) fail("has a pixel format that cannot be converted to RGB; convert the video to H.264 or FFV1");
    const int matrix = frame_->colorspace != AVCOL_SPC_UNSPECIFIED ? frame_->colorspace
                       : frame_->height >= 720                     ? SWS_CS_ITU709
                                                                   : SWS_CS_ITU601;
    const int one = 1 << 16;
    sws_setColorspaceDetails(converter_.get(), sws_getCoefficients(matrix), is_full_range(*frame_) ? 1 : 0,
                             sws_getCoefficients(SWS_CS_DEFAULT), 1, 0, one, one);
    if (converted_->width != frame_->width || converted_->height != frame_->height || converted_->format != wanted) {
      av_frame_unref(converted_.get());
      converted_->width = frame_->width, converted_->height = frame_->height, converted_->format = wanted;
      if (av_frame_get_buffer(converted_.get(), 0) < 0) throw std::bad_alloc();
    }
    sws_scale(converter_.get(), frame_->data, frame_->linesize, 0, frame_->height, converted_->data,
              converted_->linesize);
    return deep;
  }

  Encoding encoding_of_frame() const {
    if (encoding_ != Encoding::automatic) return encoding_;
    if (frame_->color_trc == AVCOL_TRC_LINEAR) return Encoding::linear;
    if (frame_->color_trc == AVCOL_TRC_SMPTE2084 || frame_->color_trc == AVCOL_TRC_ARIB_STD_B67) {
      fail(
          "is encoded for high dynamic range (PQ or HLG), which is not supported; convert the video to SDR, or read it "
          "as sRGB (encoding)");
    }
    return Encoding::srgb;
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw UserError(
        fmt::format("{}: {} {}; end before it (duration), or repair the video", path_.string(), name(), what));
  }

  std::filesystem::path path_;
  Encoding encoding_;
  bool colour_;
  Listing listing_;
  Demuxer demuxer_;
  Owned<AVCodecContext> decoder_;
  Owned<AVPacket> packet_;
  Owned<AVFrame> frame_, converted_;
  Owned<SwsContext> converter_;
  std::int64_t packets_ = 0;  // passed to the decoder
  TimeNs read_until_ = 0;     // end of the last packet
  std::int64_t count_ = 0;    // frames that advance() has reached
  std::string failure_;       // why there are no more packets
};

}  // namespace

std::unique_ptr<FrameSource> open_video_file(const std::filesystem::path& path, Encoding encoding, bool colour) {
  av_log_set_level(AV_LOG_QUIET);  // failures become exceptions
  return std::make_unique<VideoFileSource>(path, encoding, colour);
}

}  // namespace esim::inline video

#else

#include <fmt/format.h>

#include "esim/core/error.h"
#include "esim/video/frame_source.h"

namespace esim::inline video {

std::unique_ptr<FrameSource> open_video_file(const std::filesystem::path& path, Encoding, bool) {
  throw UserError(fmt::format(
      "{}: video files cannot be read, since this esim was built without FFmpeg; extract the frames, for example with "
      "`ffmpeg -i {} frames/%06d.png`, and use that folder with its frame rate",
      path.string(), path.string()));
}

}  // namespace esim::inline video

#endif
