#include "esim/light/scene_light.h"

#include <limits>

namespace esim::inline light {

void SceneLight::add_source(std::uint16_t object, Modulation light) {
  if (object >= light_of_object_.size()) light_of_object_.resize(object + std::size_t{1}, 0);
  light_of_object_[object] = lights_.size();
  lights_.emplace_back(std::move(light));
}

TimeNs SceneLight::next_node(TimeNs t, std::size_t light) const {
  return lights_[light] ? lights_[light]->next_node(t) : std::numeric_limits<TimeNs>::max();
}

}  // namespace esim::inline light
