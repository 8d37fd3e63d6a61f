#include "esim/sim/convert.h"

#include <algorithm>
#include <chrono>
#include <utility>
#include <vector>

#include "esim/core/error.h"
#include "esim/frame_camera/bayer.h"
#include "esim/recording/keep_on_failure.h"
#include "esim/sim/stopwatch.h"

namespace esim::inline sim {
namespace {

/// One conversion: processes each frame and collects the summary. The end of this file says in which order.
class Run {
 public:
  Run(const Conversion& conversion, Sink& out, const Monitor& monitor)
      : conversion_(conversion), out_(out), monitor_(monitor) {
    summary_.width = conversion.frames.width();
    summary_.height = conversion.frames.height();
  }

  /// Reads the next frame and measures how the image moves towards it; false at the end of the input.
  bool take_frame() {
    if (!timed(summary_.seconds.decode, [&] { return conversion_.frames.next(frame_); })) return false;
    timed(summary_.seconds.motion, [&] { conversion_.interpolator.advance(frame_, conversion_.workers); });
    return true;
  }

  /// Sets the pixels' references from the first frame.
  void open_pixels() {
    summary_.start = summary_.end = frame_.t;
    seen_by_pixels(frame_.planes, after_);
    see(frame_.t);
  }

  void begin_output() {
    out_.begin(info());
    write_image();
  }

  /// Processes the interval from the previous frame to this one; false if the monitor stops the conversion.
  bool cross_interval() {
    const Interpolator& interpolator = conversion_.interpolator;
    const TimeNs t0 = summary_.end, duration = frame_.t - t0;
    const auto steps = std::min<TimeNs>(interpolator.steps(), duration);
    summary_.max_optical_flow_px = std::max(summary_.max_optical_flow_px, interpolator.max_flow_px());
    if (interpolator.is_held()) ++summary_.held;
    count(interpolator.followed_pixels());

    for (TimeNs step = 1; step <= steps; ++step) {
      const double fraction = static_cast<double>(step) / static_cast<double>(steps);
      const TimeNs t = step < steps ? t0 + static_cast<TimeNs>(fraction * static_cast<double>(duration)) : frame_.t;
      timed(summary_.seconds.interpolation, [&] {
        if (step < steps) interpolator.at(fraction, conversion_.workers, between_);
        seen_by_pixels(step < steps ? between_ : frame_.planes, after_);
      });
      see(t);
      deliver_events(t);
      ++summary_.steps;
      if (step == steps) write_image();
      if (!monitor_(progress())) return false;
    }
    return true;
  }

  ConversionSummary finish(bool complete, std::string problem) {
    timed(summary_.seconds.write, [&] { out_.end(complete); });
    summary_.sensor = conversion_.event_camera.statistics();
    summary_.complete = complete;
    summary_.problem = std::move(problem);
    summary_.wall_seconds = elapsed();
    return std::move(summary_);
  }

 private:
  RecordingInfo info() const {
    const FrameSequence& frames = conversion_.frames;
    RecordingInfo info;
    info.start = frames.start();
    info.end = frames.end();
    const double duration_s = to_seconds(info.end - info.start);
    info.truth_rate_hz = duration_s > 0 ? static_cast<double>(frames.frames() - 1) / duration_s : 0;
    CameraInfo camera;
    camera.name = kConversionCamera;
    camera.model.width = summary_.width;
    camera.model.height = summary_.height;
    camera.has_labels = conversion_.event_camera.has_labels();
    info.cameras.push_back(camera);
    return info;
  }

  static void seen_by_pixels(const Planes& planes, Image<float>& irradiance) {
    if (planes.size() == 1) {
      irradiance = planes[0];
    } else {
      mosaic(planes[0], planes[1], planes[2], irradiance);
    }
  }

  void count(const FollowedPixels& pixels) {
    summary_.followed_pixels.changed += pixels.changed;
    summary_.followed_pixels.followed += pixels.followed;
    const std::int64_t few = std::int64_t{summary_.width} * summary_.height / 100;
    if (pixels.changed > few && 2 * pixels.followed < pixels.changed) ++summary_.mostly_not_followed;
  }

  /// Changes the irradiance of the pixels linearly to `after_` at time t.
  void see(TimeNs t) {
    const bool first = before_.empty();
    const Segment segment{after_.bounds(), summary_.end, t, first ? &after_ : &before_, &after_};
    timed(summary_.seconds.events, [&] { conversion_.event_camera.integrate({&segment, 1}, t, conversion_.workers); });
    std::swap(before_, after_);
    summary_.end = t;
  }

  void deliver_events(TimeNs until) {
    const EventSpan events =
        timed(summary_.seconds.events, [&] { return conversion_.event_camera.release_until(until); });
    const auto on = std::ranges::count_if(events, [](const Event& e) { return e.polarity > 0; });
    summary_.events_on += on;
    summary_.events_off += static_cast<std::int64_t>(events.size()) - on;
    if (!events.empty()) write(EventsRecord{0, events, conversion_.event_camera.labels()});
  }

  void write_image() {
    ++summary_.frames;
    write(ImageRecord{0, summary_.end, before_});
  }

  void write(const Record& record) {
    timed(summary_.seconds.write, [&] { out_.write(record); });
  }

  double elapsed() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - started_).count(); }

  Progress progress() const {
    return {summary_.start,
            summary_.end,
            conversion_.frames.end(),
            summary_.steps,
            summary_.events_on + summary_.events_off,
            elapsed()};
  }

  const Conversion& conversion_;
  Sink& out_;
  const Monitor& monitor_;
  ConversionSummary summary_;
  Frame frame_;
  Planes between_;
  Image<float> before_, after_;  // the previous and the next irradiance
  std::chrono::steady_clock::time_point started_ = std::chrono::steady_clock::now();
};

}  // namespace

std::optional<double> not_followed_fraction(const ConversionSummary& summary) {
  const auto [changed, followed] = summary.followed_pixels;
  if (changed == 0) return std::nullopt;
  return static_cast<double>(changed - followed) / static_cast<double>(changed);
}

ConversionSummary convert(const Conversion& conversion, Sink& out, const Monitor& monitor) {
  Run run(conversion, out, monitor);
  if (run.take_frame()) run.open_pixels();
  if (!run.take_frame())
    throw UserError(conversion.frames.input().string() + ": has only one frame; events need at least two");
  run.begin_output();
  try {
    do {
      if (!run.cross_interval()) return run.finish(false, "");
    } while (run.take_frame());
  } catch (const OutputError&) {
    end_incomplete(out);
    throw;
  } catch (const UserError& problem) {
    return run.finish(false, problem.what());
  } catch (...) {
    end_incomplete(out);
    throw;
  }
  return run.finish(true, "");
}

}  // namespace esim::inline sim
