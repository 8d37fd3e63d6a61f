#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>

#include "esim/scene/environment/environment.h"
#include "esim/scene/images/equirectangular.h"

// Private to backends/raycast.
namespace esim::inline backends::inline raycast {

/// Bearings of K pixels, and the sides of their footprints, as in RayBlock.
template <int K>
struct SkyRays {
  alignas(64) std::array<float, K> x, y, dx_du, dx_dv, dy_du, dy_dv;
};

/// An environment as the background of a camera.
class Sky {
 public:
  Sky(const Environment& environment, const Eigen::Matrix3f& R_world_camera)
      : environment_(environment),
        R_image_camera_(Eigen::AngleAxisf(-static_cast<float>(environment.rotation_rad()), Eigen::Vector3f::UnitZ()) *
                        R_world_camera) {}

  /// Mean radiance over each footprint. `views` as in Environment::view_offset().
  template <int K>
  std::array<float, K> radiance(const SkyRays<K>& rays, const std::array<std::uint8_t, K>& views) const {
    const TextureLookup<K> at = on_equirectangular<K>(R_image_camera_, rays);
    std::array<float, K> result{};
    for (std::uint8_t view = 0; view < 4; ++view) {
      std::uint32_t lanes = 0;
      for (unsigned i = 0; i < K; ++i) lanes |= (views[i] == view ? 1U : 0U) << i;
      if (lanes == 0) continue;
      const std::array<float, K> seen = environment_.sky(view)->template sample<K>(at, lanes);
      for (unsigned i = 0; i < K; ++i) result[i] = (lanes >> i & 1U) != 0 ? seen[i] : result[i];
    }
    return result;
  }

 private:
  const Environment& environment_;
  Eigen::Matrix3f R_image_camera_;
};

}  // namespace esim::inline backends::inline raycast
