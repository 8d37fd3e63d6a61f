#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "esim/core/image.h"
#include "esim/core/parallel.h"
#include "esim/core/state_archive.h"
#include "esim/core/time.h"
#include "esim/frame_camera/options.h"
#include "esim/light/flicker.h"
#include "esim/render/sample.h"

namespace esim::inline frame_camera {

/// An image of a frame camera.
struct CameraFrame {
  TimeNs t = 0;                    ///< middle of the exposure; with a rolling shutter, that of the middle row
  TimeNs exposure_start = 0;       ///< of the first row
  TimeNs exposure = 0;             ///< exposure time of each row
  TimeNs exposure_end = 0;         ///< of the last row
  Image<std::uint16_t> numbers{};  ///< digital numbers
};

/// A standard camera (paper, Section 7.4): integrates the irradiance of the same segments as the event camera, exactly
/// over each exposure for any sampling, and reads it out as digital numbers. docs/frames.md gives the formulae.
///
/// Frame k is centred on start + k / rate_hz. Frames whose exposure is not entirely within the simulated time are
/// omitted. Row y is exposed line_delay_s after row y - 1; the middle row is centred on the frame's time.
class FrameCamera {
 public:
  static constexpr TimeNs kNever = std::numeric_limits<TimeNs>::max();

  /// `span` is the time that the segments will cover; `stream` separates the random numbers of cameras with the same
  /// seed. Throws UserError naming the option if options contradict each other.
  FrameCamera(const FrameCameraOptions& options, int width, int height, TimeSpan span, std::uint64_t seed = 0,
              std::uint16_t stream = 0);
  ~FrameCamera();
  FrameCamera(FrameCamera&&) noexcept;
  FrameCamera& operator=(FrameCamera&&) noexcept;

  /// Takes new segments of the pixels' irradiance; the segments of a tile must be contiguous in time. No future segment
  /// begins before the watermark. `flicker`: the light of the scene, which has looked at the same segments; the same in
  /// every call, null if the light is constant. Throws UserError naming the pixel and the time if an irradiance within
  /// an exposure is not a finite number >= 0; the camera can then no longer be used.
  void integrate(std::span<const Segment> segments, TimeNs watermark, const Workers& workers,
                 const Flicker* flicker = nullptr);

  /// End of the next frame's exposure; kNever after the last one. The frame can be taken once the watermark has reached
  /// this time.
  TimeNs due() const;
  CameraFrame take();

  const FrameCameraOptions& options() const;

  /// Saves the state for restore() of a camera that was created with the same arguments.
  void save(StateWriter& archive) const;
  void restore(StateReader& archive);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace esim::inline frame_camera
