#include "esim/video/frame_sequence.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "esim/core/error.h"

namespace esim::inline video {
namespace {

namespace fs = std::filesystem;

std::unique_ptr<FrameSource> open(const fs::path& input, const VideoOptions& options, bool colour) {
  std::error_code error;
  if (fs::is_directory(input, error)) return open_image_folder(input, options.encoding, colour);
  if (!fs::exists(input, error)) throw UserError(fmt::format("{}: no such file or folder", input.string()));
  return open_video_file(input, options.encoding, colour);
}

std::string out_of_order(TimeNs t, TimeNs before) {
  return fmt::format(
      "its time, {:.9f} s, is not after that of the previous frame, {:.9f} s; correct the time stamps, or replace them "
      "by a constant frame rate (fps)",
      to_seconds(t), to_seconds(before));
}

constexpr int kMaxSide = 16384;

bool is_irradiance(float value) { return value >= 0 && value <= std::numeric_limits<float>::max(); }

}  // namespace

std::string problem_of(const Planes& planes) {
  for (const Image<float>& plane : planes) {
    const auto pixels = plane.pixels();
    const auto bad = std::find_if_not(pixels.begin(), pixels.end(), is_irradiance);
    if (bad == pixels.end()) continue;
    const int at = static_cast<int>(bad - pixels.begin());
    return fmt::format("pixel ({}, {}) is {}; irradiance must be finite and >= 0", at % plane.width(),
                       at / plane.width(), *bad);
  }
  return "";
}

FrameSequence::FrameSequence(const fs::path& input, const VideoOptions& options, bool colour)
    : input_(input), source_(open(input, options, colour)), fps_(options.fps), slow_motion_(options.slow_motion) {
  const FrameSource::Listing& listing = source_->listing();
  if (listing.frames == 0) throw UserError(fmt::format("{}: holds no frames", input.string()));
  if (!fps_ && listing.stamps.empty()) {
    throw UserError(
        fmt::format("{}: the frames have no time stamps; state the number of frames per second (fps)", input.string()));
  }
  choose_window(options);
  first_.emplace();
  if (!read(*first_)) throw UserError(fmt::format("{}: none of its frames can be read", input.string()));
  start_ = first_->t;
  width_ = first_->planes.front().width();
  height_ = first_->planes.front().height();
  if (std::max(width_, height_) > kMaxSide) {
    throw UserError(fmt::format("{}: the frames are {} x {} px; they must be at most {} px wide and high",
                                input.string(), width_, height_, kMaxSide));
  }
}

TimeNs FrameSequence::stamp_of(std::size_t index) const {
  return fps_ ? to_ns(static_cast<double>(index) / *fps_) : source_->listing().stamps[index];
}

TimeNs FrameSequence::time_of(TimeNs stamp) const {
  if (slow_motion_ == 1.0) return stamp;
  return origin_ + static_cast<TimeNs>(std::llround(static_cast<double>(stamp - origin_) / slow_motion_));
}

void FrameSequence::choose_window(const VideoOptions& options) {
  const std::size_t count = source_->listing().frames;
  origin_ = stamp_of(0);
  first_stamp_ = origin_ + to_ns(options.start);
  last_stamp_ = options.duration ? first_stamp_ + to_ns(*options.duration) : std::numeric_limits<TimeNs>::max();
  for (std::size_t i = 0; i < count; ++i) {
    const TimeNs stamp = stamp_of(i);
    if (i > 0 && stamp <= stamp_of(i - 1)) {
      throw UserError(fmt::format("{}: frame {}: {}", input_.string(), i, out_of_order(stamp, stamp_of(i - 1))));
    }
    if (stamp < first_stamp_ || stamp > last_stamp_) continue;
    ++frames_;
    end_ = time_of(stamp);
  }
  const TimeNs input_end = stamp_of(count - 1);
  if (first_stamp_ > input_end) {
    throw UserError(fmt::format("{}: the start, {} s, is beyond the last frame, {:.3f} s after the first",
                                input_.string(), options.start, to_seconds(input_end - origin_)));
  }
}

bool FrameSequence::next(Frame& frame) {
  if (first_) {
    frame = std::move(*first_);
    first_.reset();
    previous_ = frame.t;
    return true;
  }
  if (!read(frame)) return false;
  if (frame.t <= previous_) fail(out_of_order(frame.t, previous_));
  previous_ = frame.t;
  return true;
}

bool FrameSequence::read(Frame& frame) {
  while (source_->advance()) {
    const std::size_t index = index_++;
    const std::optional<TimeNs> stamp = fps_ ? stamp_of(index) : source_->stamp();
    if (!stamp) fail("has no time stamp; state the number of frames per second (fps)");
    if (*stamp > last_stamp_) return false;
    if (*stamp < first_stamp_) continue;
    source_->read(frame.planes);
    frame.t = time_of(*stamp);
    check(frame);
    return true;
  }
  return false;
}

void FrameSequence::check(const Frame& frame) const {
  const Image<float>& plane = frame.planes.front();
  if (width_ > 0 && (plane.width() != width_ || plane.height() != height_)) {
    fail(fmt::format("is {} x {} px, but the first one {} x {}; all frames must have the same size", plane.width(),
                     plane.height(), width_, height_));
  }
  if (const std::string problem = problem_of(frame.planes); !problem.empty()) fail(problem);
}

void FrameSequence::fail(const std::string& what) const {
  throw UserError(fmt::format("{}: {}: {}", input_.string(), source_->name(), what));
}

}  // namespace esim::inline video
