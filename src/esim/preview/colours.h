#pragma once

#include <cstdint>

#include "esim/core/image.h"

namespace esim::inline preview {

struct Rgb {
  std::uint8_t r = 0, g = 0, b = 0;
  bool operator==(const Rgb&) const = default;
};

/// Blends two colours: `amount` (0 to 1) of the second.
inline Rgb mix(Rgb from, Rgb to, float amount) {
  const auto blend = [amount](std::uint8_t a, std::uint8_t b) {
    const float value = static_cast<float>(a) + amount * static_cast<float>(b - a);
    return static_cast<std::uint8_t>((value < 0.0f ? 0.0f : value > 255.0f ? 255.0f : value) + 0.5f);
  };
  return {blend(from.r, to.r), blend(from.g, to.g), blend(from.b, to.b)};
}

// Orange and blue are distinguishable with any kind of colour vision.
inline constexpr Rgb kOnColour{255, 152, 20};
inline constexpr Rgb kOffColour{40, 140, 255};

/// The colour of pixels without depth; not a colour of the depth map.
inline constexpr Rgb kNoDepthColour{196, 196, 196};

/// Event counts over an image: hue by the fraction of ON events, opacity by the number, full at 8 events. Counts may be
/// fractions, for example after resampling. All images have the same size.
Image<Rgb> render_events(const Image<float>& on, const Image<float>& off, Image<Rgb> background);

/// The same over the dimmed image of a linear irradiance.
Image<Rgb> render_events(const Image<float>& on, const Image<float>& off, const Image<float>& irradiance);

/// Dims an image, so that events stand out.
Image<Rgb> dimmed(Image<Rgb> image);

/// Irradiance as sRGB-encoded grey.
Image<Rgb> grey(const Image<float>& irradiance);

/// The motion field in the colour code of Baker et al., "A Database and Evaluation Methodology for Optical Flow", IJCV
/// 2011: hue by direction, white at rest, saturated at `full_scale_px_per_s`, darker beyond it.
Image<Rgb> colour_motion(const Image<float>& motion_x, const Image<float>& motion_y, float full_scale_px_per_s);
Rgb colour_motion(float x, float y, float full_scale);

/// Depth in the colour map viridis, on a logarithmic scale from near_m (yellow) to far_m (violet), clamped;
/// kNoDepthColour for invalid depth (infinite, NaN or not positive). 0 < near_m < far_m.
Image<Rgb> colour_depth(const Image<float>& depth_m, float near_m, float far_m);
Rgb colour_depth(float depth_m, float near_m, float far_m);

}  // namespace esim::inline preview
