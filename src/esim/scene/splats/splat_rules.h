#pragma once

#include "esim/scene/splats/splats.h"

/// Numbers that all renderers of splats share.
namespace esim::inline scene {

/// Opacities between these fade to zero. In models, splats end at 1/255.
inline constexpr float kFadeFrom = 1.5F / 255, kInvisible = 0.5F / 255;

/// Nearer splats are invisible, and splats fade up to twice this depth; m.
inline constexpr float kNearest = 0.01F;

inline constexpr float kOpaque = 0.99F;    ///< the largest opacity, as in the original 3D Gaussian splatting
inline constexpr float kFinished = 1e-4F;  ///< transmittance below which pixels are finished, likewise

/// Weight of the inverse distance of a splat's centre in the order `ray`, relative to its inverse depth on the ray.
inline constexpr float kTieBreak = 1.0F / 1024;

/// Bearings at which the Jacobian of a linear projection is taken, relative to those of the image, likewise.
inline constexpr float kLinearLimit = 1.3F;

/// The radius of ideal points at which unscented points end, relative to that of the image. Points farther outside
/// would make a splat next to the camera as large as the image.
inline constexpr float kUnscentedLimit = 1.5F;

/// The variance by which a filter widens splats, in squares of a pixel's footprint.
constexpr float variance_of(SplatFilter filter) { return filter == SplatFilter::mip ? 0.1F : 0.3F; }

}  // namespace esim::inline scene
