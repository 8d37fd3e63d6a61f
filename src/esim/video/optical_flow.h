#pragma once

#include <memory>

#include "esim/core/image.h"
#include "esim/core/parallel.h"

namespace esim {

/// A displacement per pixel, px: x to the right, y downwards.
struct FlowField {
  Image<float> x, y;
};

/// How image content moves between two frames.
class OpticalFlow {
 public:
  OpticalFlow(int width, int height);
  ~OpticalFlow();
  OpticalFlow(OpticalFlow&&) noexcept;
  OpticalFlow& operator=(OpticalFlow&&) noexcept;

  /// Estimates where the pixels of `before` are in `after` and the other way round, in linear luminance. Dense inverse
  /// search (Kroeger et al., ECCV 2016) on the square root of the light, which evens out noise as sRGB does, scaled so
  /// that 8 bits span the brighter of the frames. Displacements of two fields that contradict each other, as at
  /// occlusions and in what enters the image, are replaced: by the one of the field that is consistent, else by none.
  void estimate(const Image<float>& before, const Image<float>& after, const Workers& workers, FlowField& forward,
                FlowField& backward);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace esim
