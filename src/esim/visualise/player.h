#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "esim/visualise/survey.h"
#include "esim/visualise/theme.h"

namespace esim {

/// How a recording is shown. What is 0 or empty is chosen by choose_missing().
struct PlayOptions {
  std::vector<View> views{};
  double frames_per_s = 30;       ///< of the video
  double slow_motion = 0;         ///< how many times slower than real time
  double window_s = 0;            ///< of the events that a picture of events shows
  std::size_t window_events = 0;  ///< shows so many events instead, where it is above 0
  double tau_s = 0;               ///< decay of the time surface
  double span_s = 0;              ///< of the space-time plot
  int width = 0;                  ///< of the whole, px
  Theme theme{};
  std::string name{};  ///< of the recording, for the headline and messages
};

/// The same with everything chosen: all views that there are; slow motion of 1, 2 or 5 times a power of ten, so that
/// the video lasts about 4 s or longer; a window in which, on average, an event falls on every twelfth pixel, 1 to 50
/// ms; tau of 1.5 windows; a span of 20. Throws UserError where there are no events, and for views of which there are
/// no records.
PlayOptions choose_missing(PlayOptions options, const Survey& survey);

/// The instants that are shown.
struct Instants {
  TimeNs first = 0;
  double step_ns = 0;
  std::size_t count = 1;

  TimeNs at(std::size_t index) const { return first + static_cast<TimeNs>(step_ns * static_cast<double>(index)); }
};

/// Those of a video. Throws UserError where there are more than a million.
Instants video_instants(const Survey& survey, const PlayOptions& options);

/// Shows one camera of a recording, instant by instant: events up to it and the pictures that are due. Memory is
/// bounded, whatever the length and the rates of the recording.
class Player {
 public:
  /// `source` stands at its first record; `options` are complete.
  Player(Source& source, int camera, const Survey& survey, const PlayOptions& options, const Instants& instants);
  ~Player();

  /// The panels of the next instant, side by side; nothing after the last one. Throws what the source throws.
  std::optional<Image<Rgb>> next();

  /// Instead, the first view alone, without anything around it.
  std::optional<Image<Rgb>> next_picture();

  /// The size of what next() gives.
  const PageLayout& layout() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace esim
