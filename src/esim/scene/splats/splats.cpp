#include "esim/scene/splats/splats.h"

#include <fmt/format.h>

namespace esim::inline scene {

Eigen::AlignedBox3d bounds(const Splats& splats) {
  Eigen::AlignedBox3d box;
  const Eigen::Matrix3d R = splats.to_object.toRotationMatrix();
  for (const Eigen::Vector3f& position : splats.positions) box.extend(R * position.cast<double>());
  return box;
}

std::string summary(const Splats& splats) {
  constexpr const char* kFilters[] = {"dilated", "antialiased", "mip"};
  const Eigen::Vector3d size = bounds(splats).sizes();
  return fmt::format("{} splats of degree {}, {:.3g} x {:.3g} x {:.3g} m, {}, in {}", splats.size(), splats.degree,
                     size.x(), size.y(), size.z(), kFilters[static_cast<int>(splats.filter)],
                     splats.light == SplatLight::linear ? "linear light" : "display colours");
}

}  // namespace esim::inline scene
