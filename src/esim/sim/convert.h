#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "esim/core/parallel.h"
#include "esim/record/record.h"
#include "esim/sensors/event_camera.h"
#include "esim/sim/simulate.h"
#include "esim/video/frame_sequence.h"
#include "esim/video/interpolator.h"

namespace esim {

/// Name of the camera that sees the video.
inline constexpr const char* kConversionCamera = "cam0";

/// What a conversion did, for the report.
struct ConversionSummary {
  bool complete = false;
  std::string problem;         ///< why it ended before the end of the input; empty: it did not, or was interrupted
  TimeNs start = 0, end = 0;   ///< of the time that was converted
  int width = 0, height = 0;   ///< px
  std::int64_t frames = 0;     ///< of the input
  std::int64_t steps = 0;      ///< of the interpolation
  std::int64_t held = 0;       ///< intervals that needed more than max_steps
  double displacement_px = 0;  ///< greatest between two frames
  std::int64_t events_on = 0, events_off = 0;
  EventCameraStatistics sensor;

  /// How much the events' rate varies between two frames, rms, relative to its mean; nothing where it is not known.
  /// Measured by who reports it (stats/between_frames.h).
  std::optional<double> modulation{};

  /// Wall-clock seconds by stage.
  struct Seconds {
    double decode = 0, motion = 0, interpolation = 0, events = 0, write = 0;
  } seconds;
  double wall_seconds = 0;
};

/// Everything that a conversion works on.
struct Conversion {
  FrameSequence& frames;
  Interpolator& interpolator;
  EventCamera& event_camera;  ///< of the frames' size; frames of three planes reach it as a Bayer mosaic
  const Workers& workers;
};

/// Turns a video into events: between each two frames as many steps as the motion asks for, from each to the next a
/// segment for the event camera. Writes the events of camera 0 and an ImageRecord for each frame. The sibling of
/// simulate() for given frames: time moves only here. The monitor is called after every step.
///
/// Throws UserError, with nothing written, if there are not two frames. A later frame that cannot be used ends the
/// conversion in order, incomplete, and the summary names the problem.
ConversionSummary convert(const Conversion& conversion, Sink& out, const Monitor& monitor);

}  // namespace esim
