#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "esim/core/image.h"
#include "esim/core/parallel.h"
#include "esim/core/time.h"
#include "esim/render/sample.h"
#include "esim/sensors/frame_camera_options.h"

namespace esim {

/// An image of a frame camera.
struct CameraFrame {
  TimeNs t = 0;               ///< middle of the exposure; of the middle row, where rows have exposures of their own
  TimeNs exposure_start = 0;  ///< of the first row
  TimeNs exposure = 0;        ///< how long each row is exposed
  TimeNs exposure_end = 0;    ///< of the last row
  Image<std::uint16_t> numbers{};  ///< digital numbers
};

/// A standard camera (paper, Section 7.4): integrates the light of the same segments that the event camera sees,
/// exactly over each exposure, however they were sampled, and reads it out as digital numbers. docs/frames.md gives the
/// formulae.
///
/// Frame k is centred on start + k / rate_hz. Frames whose exposure is not wholly within the time that is simulated are
/// left out. Row y is exposed line_delay_s after row y - 1; the middle of the image keeps to the frame's time.
class FrameCamera {
 public:
  static constexpr TimeNs kNever = std::numeric_limits<TimeNs>::max();

  /// `span` is the time for which segments will come; `stream` separates the random numbers of cameras that share a
  /// seed. Throws UserError naming the option where the options contradict each other.
  FrameCamera(const FrameCameraOptions& options, int width, int height, TimeSpan span, std::uint64_t seed = 0,
              std::uint16_t stream = 0);
  ~FrameCamera();
  FrameCamera(FrameCamera&&) noexcept;
  FrameCamera& operator=(FrameCamera&&) noexcept;

  /// Takes what is newly known of the pixels' irradiance: those of a tile one after the other, contiguous in time. No
  /// segment that is still to come begins before the watermark. Throws UserError naming the pixel and the time where an
  /// irradiance of an exposure is not a finite number >= 0; the camera is then of no use any more.
  void integrate(std::span<const Segment> segments, TimeNs watermark, const Workers& workers);

  /// When the exposure of the next frame ends; kNever after the last one. Once the watermark has come that far, the
  /// frame can be taken.
  TimeNs due() const;
  CameraFrame take();

  const FrameCameraOptions& options() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace esim
