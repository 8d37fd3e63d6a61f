#include "esim/scene/splats/splats.h"

#include <fmt/format.h>

#include <algorithm>

namespace esim::inline scene {

double largest_area(const Eigen::Vector3d& deviations) {
  return std::max({deviations.x() * deviations.y(), deviations.y() * deviations.z(), deviations.z() * deviations.x()});
}

Eigen::AlignedBox3d bounds(const Splats& splats) {
  Eigen::AlignedBox3d box;
  const Eigen::Matrix3d R = splats.to_object.toRotationMatrix();
  for (const Eigen::Vector3f& position : splats.positions) box.extend(R * position.cast<double>());
  return box;
}

double share_at_white(const Splats& splats) {
  if (splats.light == SplatLight::linear) return 0;
  double white = 0, all = 0;
  for (std::size_t i = 0; i < splats.size(); ++i) {
    const double weight = double{splats.opacities[i]} * largest_area(splats.deviations[i].cast<double>());
    const float* const harmonics = &splats.harmonics[i * splats.coefficients() * 3];
    const float brightest = 0.5F + kHarmonic0 * std::max({harmonics[0], harmonics[1], harmonics[2]});
    all += weight;
    if (brightest >= 0.98F) white += weight;
  }
  return all > 0 ? white / all : 0;
}

std::string summary(const Splats& splats) {
  constexpr const char* kFilters[] = {"dilated", "antialiased", "mip"};
  const Eigen::Vector3d size = bounds(splats).sizes();
  return fmt::format("{} splats of degree {}, {:.3g} x {:.3g} x {:.3g} m, {}, in {}", splats.size(), splats.degree,
                     size.x(), size.y(), size.z(), kFilters[static_cast<int>(splats.filter)],
                     splats.light == SplatLight::linear ? "linear light" : "display colours");
}

}  // namespace esim::inline scene
