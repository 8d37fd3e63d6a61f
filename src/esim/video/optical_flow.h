#pragma once

#include <cstdint>
#include <memory>

#include "esim/core/image.h"
#include "esim/core/parallel.h"

namespace esim::inline video {

/// Optical flow: a displacement per pixel, px; x to the right, y downwards.
struct FlowField {
  Image<float> x, y;
  Image<std::uint8_t> found;  ///< 0 where it could not be estimated; x and y are then 0
};

/// Estimates the optical flow between two frames.
class OpticalFlow {
 public:
  OpticalFlow(int width, int height);
  ~OpticalFlow();
  OpticalFlow(OpticalFlow&&) noexcept;
  OpticalFlow& operator=(OpticalFlow&&) noexcept;

  /// Estimates the optical flow from `before` to `after` and back; both in linear luminance. Uses dense inverse search
  /// (Kroeger et al., ECCV 2016) on the square root of the irradiance, which equalises noise as sRGB does, scaled so
  /// that 8 bits cover the brighter of the frames. Where the two fields contradict each other, as at occlusions and in
  /// content that enters the image, a displacement is replaced by that of the consistent field; if both contradict each
  /// other there, it is not found.
  void estimate(const Image<float>& before, const Image<float>& after, const Workers& workers, FlowField& forward,
                FlowField& backward);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace esim::inline video
