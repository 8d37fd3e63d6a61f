#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "esim/scene/planes.h"
#include "esim/scene/splats/splats.h"

namespace esim::inline scene {

/// From the space in which splats are composited to linear light. For SplatLight::display this is a power of `gamma`,
/// or the sRGB curve (IEC 61966-2-1) if gamma is 0; both continue above white. Between entries of the table the curve
/// is linear, within 3e-6 of its value.
class DisplayCurve {
 public:
  DisplayCurve(SplatLight light, double gamma) : gamma_(static_cast<float>(gamma)) {
    if (light == SplatLight::linear) return;
    for (std::size_t i = 0; i <= kEntries; ++i)
      table_.push_back(exact(static_cast<float>(i) / static_cast<float>(kEntries)));
  }

  float linear(float encoded) const {
    if (table_.empty() || encoded <= 0) return std::max(encoded, 0.0F);
    const float place = encoded * static_cast<float>(kEntries);
    const auto i = static_cast<std::size_t>(place);
    if (i >= kEntries) return exact(encoded);
    return table_[i] + (place - static_cast<float>(i)) * (table_[i + 1] - table_[i]);
  }

  /// linear() from 0 to 1, in equal steps; empty if it changes nothing.
  const std::vector<float>& table() const { return table_; }

  /// The inverse of linear().
  float encoded(float linear) const {
    if (table_.empty() || linear <= 0) return std::max(linear, 0.0F);
    return gamma_ > 0 ? std::pow(linear, 1 / gamma_) : srgb_from_linear(linear);
  }

 private:
  static constexpr std::size_t kEntries = 4096;

  float exact(float encoded) const { return gamma_ > 0 ? std::pow(encoded, gamma_) : linear_from_srgb(encoded); }

  float gamma_;
  std::vector<float> table_;
};

}  // namespace esim::inline scene
