#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "esim/core/describe.h"
#include "esim/core/time.h"
#include "esim/scene/planes.h"
#include "esim/video/frame_source.h"

namespace esim::inline video {

/// Which frames of a video are read, and how they are interpreted.
struct VideoOptions {
  Encoding encoding = Encoding::automatic;
  std::optional<double> fps{};
  double slow_motion = 1.0;
  double start = 0.0;
  std::optional<double> duration{};
};

template <class Visitor>
void describe(Visitor& visit, VideoOptions& o) {
  visit("encoding", o.encoding,
        About{"encoding of the pixel values; auto: integers are sRGB, floating point (EXR, HDR) is linear"});
  visit("fps", o.fps, About{"frames per second, instead of the input's time stamps", "Hz", 0, 1e9, true});
  visit("slow_motion", o.slow_motion,
        About{"factor by which the scene was faster than the time stamps say", "", 0, 1e9, true});
  visit("start", o.start, About{"start of the conversion, after the first frame, by the time stamps", "s", 0, 1e9});
  visit("duration", o.duration, About{"duration to convert, by the time stamps (default: all)", "s", 0, 1e9, true});
}

struct Frame {
  TimeNs t = 0;
  Planes planes;
};

/// The first pixel whose irradiance is negative or not finite, and why it is refused; empty if all pixels are valid.
std::string problem_of(const Planes& planes);

/// Reads the chosen frames of a video or of a folder of images and checks that times increase, all sizes are equal, and
/// every irradiance is finite and >= 0. Holds at most one frame.
class FrameSequence {
 public:
  /// Opens the input and reads its first frame: three planes if `colour`, otherwise luminance. Throws UserError if
  /// there are no frames or no time stamps.
  FrameSequence(const std::filesystem::path& input, const VideoOptions& options, bool colour);

  /// Reads the next frame into `frame`, reusing its memory; false at the end. Throws UserError naming the invalid frame
  /// and a remedy.
  bool next(Frame& frame);

  const std::filesystem::path& input() const { return input_; }
  int width() const { return width_; }
  int height() const { return height_; }

  /// Number of frames that the input declares; a damaged one may hold fewer.
  std::int64_t frames() const { return frames_; }
  TimeNs start() const { return start_; }
  TimeNs end() const { return end_; }

 private:
  TimeNs stamp_of(std::size_t index) const;
  TimeNs time_of(TimeNs stamp) const;
  void choose_window(const VideoOptions& options);
  bool read(Frame& frame);
  void check(const Frame& frame) const;
  [[noreturn]] void fail(const std::string& what) const;

  std::filesystem::path input_;
  std::unique_ptr<FrameSource> source_;
  std::optional<double> fps_;
  double slow_motion_;
  std::size_t index_ = 0;                                 // of the next frame
  TimeNs origin_ = 0, first_stamp_ = 0, last_stamp_ = 0;  // of the input; of the chosen part
  std::int64_t frames_ = 0;
  TimeNs start_ = 0, end_ = 0;
  int width_ = 0, height_ = 0;
  std::optional<Frame> first_;  // until next() returns it
  TimeNs previous_ = 0;         // time of the last frame
};

}  // namespace esim::inline video
