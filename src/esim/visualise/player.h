#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "esim/plot/theme.h"
#include "esim/visualise/recording_overview.h"

namespace esim::inline visualise {

/// How a recording is shown. choose_missing() replaces 0 and empty values.
struct PlayOptions {
  std::vector<View> views{};
  double frames_per_s = 30;       ///< of the video
  double slow_motion = 0;         ///< factor by which the video is slower than real time
  double window_s = 0;            ///< duration of the events in an event image
  std::size_t window_events = 0;  ///< if above 0: number of events to show instead
  double tau_s = 0;               ///< decay of the time surface
  double span_s = 0;              ///< duration of the space-time plot
  int width = 0;                  ///< of the page, px
  Theme theme{};
  std::string name{};  ///< of the recording, for the headline and messages
};

/// The same with every value set: all available views; slow motion of 1, 2 or 5 times a power of ten such that the
/// video lasts at least about 4 s; a window of 1 to 50 ms with, on average, one event per twelve pixels; tau of 1.5
/// windows; a span of 20 windows. Throws UserError if there are no events, and for views without records.
PlayOptions choose_missing(PlayOptions options, const RecordingOverview& overview);

/// The instants to show.
struct Instants {
  TimeNs first = 0;
  double step_ns = 0;
  std::size_t count = 1;

  TimeNs at(std::size_t index) const { return first + static_cast<TimeNs>(step_ns * static_cast<double>(index)); }
};

/// The instants of a video. Throws UserError if there are more than a million.
Instants video_instants(const RecordingOverview& overview, const PlayOptions& options);

/// Shows one camera of a recording, instant by instant: the events up to the instant and the images that are due.
/// Memory is bounded for any length and rates of the recording.
class Player {
 public:
  /// `source` must be at its first record; `options` must come from choose_missing().
  Player(Source& source, int camera, const RecordingOverview& overview, const PlayOptions& options,
         const Instants& instants);
  ~Player();

  /// The page of the next instant; nothing after the last one. Passes on exceptions of the source.
  std::optional<Image<Rgb>> next();

  /// Alternatively: only the first view, without decoration.
  std::optional<Image<Rgb>> next_picture();

  /// The layout of the images that next() returns.
  const PageLayout& layout() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace esim::inline visualise
