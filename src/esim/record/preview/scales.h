#pragma once

#include "esim/core/image.h"

namespace esim {

/// The range of depths that the preview's colours span. Stable over time: it only ever grows, in steps that make room
/// for more.
class DepthScale {
 public:
  void include(const Image<float>& depth_m);

  float near_m() const { return near_m_; }
  float far_m() const { return far_m_; }

 private:
  float near_m_ = 0, far_m_ = 0;
};

/// The speed of the preview's most saturated colours: a round number, and never less than before.
class FlowScale {
 public:
  void include(const Image<float>& flow_x, const Image<float>& flow_y);

  float full_px_per_s() const { return full_px_per_s_; }

 private:
  float full_px_per_s_ = 1;
};

}  // namespace esim
