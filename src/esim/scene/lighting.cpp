#include "esim/scene/lighting.h"

#include <algorithm>

namespace esim::inline scene {
namespace {

template <class Light>
bool has_curve(const std::vector<Light>& lights) {
  return std::any_of(lights.begin(), lights.end(), [](const Light& light) { return !light.curve.points.empty(); });
}

template <class Light>
void apply_curves(std::vector<Light>& lights, TimeNs t) {
  for (Light& light : lights) {
    if (light.curve.points.empty()) continue;
    light.strength *= light.curve.at(t);
    light.curve = {};
  }
}

}  // namespace

float StrengthCurve::at(TimeNs t) const {
  if (points.empty()) return 1;
  const double t_s = to_seconds(t);
  const auto next = std::upper_bound(points.begin(), points.end(), t_s,
                                     [](double time_s, const Point& point) { return time_s < point.t_s; });
  if (next == points.begin()) return points.front().factor;
  const auto last = next - 1;
  if (next == points.end()) return last->factor;
  const auto part = static_cast<float>((t_s - last->t_s) / (next->t_s - last->t_s));
  return last->factor + part * (next->factor - last->factor);
}

Lighting lighting_at(const Lighting& lighting, TimeNs t, std::span<const SE3> objects) {
  Lighting now = lighting;
  apply_curves(now.suns, t);
  apply_curves(now.points, t);
  apply_curves(now.areas, t);
  for (PointLight& light : now.points) {
    if (!light.object) continue;
    light.position = (objects[*light.object] * light.position.cast<double>()).cast<float>();
    light.object.reset();
  }
  for (AreaLight& light : now.areas) {
    if (!light.object) continue;
    const SE3& T_world_object = objects[*light.object];
    const Eigen::Matrix3f R = T_world_object.rotation.toRotationMatrix().cast<float>();
    light.position = (T_world_object * light.position.cast<double>()).cast<float>();
    light.half_u = R * light.half_u, light.half_v = R * light.half_v, light.direction = R * light.direction;
    light.object.reset();
  }
  return now;
}

bool varies(const Lighting& lighting) {
  return has_curve(lighting.suns) || has_curve(lighting.points) || has_curve(lighting.areas);
}

}  // namespace esim::inline scene
