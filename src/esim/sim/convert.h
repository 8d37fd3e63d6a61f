#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "esim/core/parallel.h"
#include "esim/event_camera/event_camera.h"
#include "esim/recording/record.h"
#include "esim/sim/simulate.h"
#include "esim/video/frame_sequence.h"
#include "esim/video/interpolator.h"

namespace esim::inline sim {

/// Name of the camera that sees the video.
inline constexpr const char* kConversionCamera = "cam0";

/// Results of a conversion, for the report.
struct ConversionSummary {
  bool complete = false;
  std::string problem;             ///< why it failed before the end of the input; empty if complete or interrupted
  TimeNs start = 0, end = 0;       ///< of the converted time
  int width = 0, height = 0;       ///< px
  std::int64_t frames = 0;         ///< of the input
  std::int64_t steps = 0;          ///< of the interpolation
  std::int64_t held = 0;           ///< intervals that needed more than max_steps
  double max_optical_flow_px = 0;  ///< maximum between two frames
  FollowedPixels followed_pixels;  ///< sums over all intervals

  /// Intervals in which the optical flow follows fewer than half of the pixels that change, if more than 1 % change.
  std::int64_t mostly_not_followed = 0;

  std::int64_t events_on = 0, events_off = 0;
  EventCameraStatistics sensor;

  /// Variation of the event rate between two frames, rms, relative to its mean; empty if unknown. The caller measures
  /// it (stats/between_frames.h).
  std::optional<double> modulation{};

  /// Wall-clock seconds by stage.
  struct Seconds {
    double decode = 0, motion = 0, interpolation = 0, events = 0, write = 0;
  } seconds;
  double wall_seconds = 0;
};

/// Fraction of the changed pixels that the optical flow does not follow; empty if no pixel changed, or without optical
/// flow.
std::optional<double> not_followed_fraction(const ConversionSummary& summary);

/// The parts of a conversion.
struct Conversion {
  FrameSequence& frames;
  Interpolator& interpolator;
  EventCamera& event_camera;  ///< of the frames' size; frames of three planes reach it as a Bayer mosaic
  const Workers& workers;
};

/// Converts a video to events: divides the time between two frames into steps according to the motion; each step is a
/// segment for the event camera. Writes the events of camera 0 and an ImageRecord for each frame. This is the main loop
/// for given frames, as simulate() is for scenes. The monitor is called after every step.
///
/// Throws UserError, with nothing written, if there are fewer than two frames. An unusable later frame ends the
/// conversion as incomplete, and the summary contains the problem.
ConversionSummary convert(const Conversion& conversion, Sink& out, const Monitor& monitor);

}  // namespace esim::inline sim
