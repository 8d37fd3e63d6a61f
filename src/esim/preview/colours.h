#pragma once

#include "esim/core/image.h"
#include "esim/plot/colour.h"

namespace esim::inline preview {

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

/// The colour map viridis, from 0 (violet) to 1 (yellow), clamped.
Rgb viridis(float position);

/// Depth in the colour map viridis, on a logarithmic scale from near_m (yellow) to far_m (violet), clamped;
/// kNoDepthColour for invalid depth (infinite, NaN or not positive). 0 < near_m < far_m.
Image<Rgb> colour_depth(const Image<float>& depth_m, float near_m, float far_m);
Rgb colour_depth(float depth_m, float near_m, float far_m);

}  // namespace esim::inline preview
