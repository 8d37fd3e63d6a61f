#pragma once

#include "esim/core/image.h"

namespace esim::inline preview {

/// The depth range of the preview colours. It only grows, in steps with a margin, so that it is stable over time.
class DepthScale {
 public:
  void include(const Image<float>& depth_m);

  float near_m() const { return near_m_; }
  float far_m() const { return far_m_; }

 private:
  float near_m_ = 0, far_m_ = 0;
};

/// The speed with the most saturated colour in the preview: a round number that never decreases.
class MotionScale {
 public:
  void include(const Image<float>& motion_x, const Image<float>& motion_y);

  float full_px_per_s() const { return full_px_per_s_; }

 private:
  float full_px_per_s_ = 1;
};

}  // namespace esim::inline preview
