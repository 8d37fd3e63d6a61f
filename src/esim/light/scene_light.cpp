#include "esim/light/scene_light.h"

#include <limits>

namespace esim::inline light {

void SceneLight::add_source(std::uint16_t object, Modulation light) {
  if (object >= light_of_object_.size()) light_of_object_.resize(object + std::size_t{1}, 0);
  light_of_object_[object] = lights_.size();
  lights_.emplace_back(std::move(light));
}

Modulation::Integrals SceneLight::integrals(TimeNs t0, TimeNs t1, std::size_t light) const {
  if (lights_[light]) return lights_[light]->integrals(t0, t1);
  const double duration = to_seconds(t1 - t0);
  return {duration, duration * duration / 2};
}

TimeNs SceneLight::next_node(TimeNs t, std::size_t light) const {
  return lights_[light] ? lights_[light]->next_node(t) : std::numeric_limits<TimeNs>::max();
}

}  // namespace esim::inline light
