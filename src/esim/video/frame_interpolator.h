#pragma once

#include <string>

#include "esim/video/frame_sequence.h"

namespace esim::inline video {

/// Makes the images between two frames of a video in place of the interpolation along the optical flow: a learned
/// interpolator. Images are linear irradiance, as the frames of FrameSequence.
class FrameInterpolator {
 public:
  virtual ~FrameInterpolator() = default;

  /// Names it in messages: "the interpolator model.onnx".
  virtual std::string name() const = 0;

  /// The image at the fraction in (0, 1) of the time between two frames, with the size and the number of planes of the
  /// frames. The same arguments must give the same image. Throws UserError if it fails.
  virtual void between(const Frame& frame0, const Frame& frame1, double fraction, Planes& light) = 0;
};

}  // namespace esim::inline video
