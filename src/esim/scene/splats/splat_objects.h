#pragma once

#include <cstddef>
#include <memory>
#include <optional>

#include "esim/scene/splats/splats.h"

/// For renderers of splats.
namespace esim::inline scene {

struct SplatOptions {
  SplatProjection projection = SplatProjection::automatic;
  SplatOrder order = SplatOrder::distance;
  double display_gamma = 0;  ///< exponent from display colours to linear light; 0: the sRGB curve
  float background = 0;      ///< irradiance behind all splats
  float gain = 1;            ///< factor from linear light to irradiance
};

/// Splats that move together: all that is static, or an object with its own motion.
struct SplatObject {
  std::shared_ptr<const Splats> splats;  ///< in the object's frame, which is the world frame if it does not move
  std::optional<std::size_t> moving{};   ///< which of RenderRequest::objects it is, if it moves
};

}  // namespace esim::inline scene
