#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "esim/core/time.h"
#include "esim/light/modulation.h"

namespace esim::inline light {

/// The flickering lights of a scene: the light that falls on it, and objects that are lights themselves (screens,
/// lamps), whose pixels see only their own flicker. Objects have the numbers of Sample::object: 0 for none.
class SceneLight {
 public:
  /// Light 0 is that of the scene.
  explicit SceneLight(std::optional<Modulation> scene) : lights_{std::move(scene)} {}

  /// Makes an object a light of its own. Objects are numbered from 1.
  void add_source(std::uint16_t object, Modulation light);

  bool has_sources() const { return lights_.size() > 1; }
  bool flickers() const { return has_sources() || lights_[0]; }
  std::size_t lights() const { return lights_.size(); }

  /// The light by which pixels see an object.
  std::size_t light_of(std::uint16_t object) const {
    return object < light_of_object_.size() ? light_of_object_[object] : 0;
  }

  /// Factor on the irradiance of pixels that see an object, relative to its mean.
  double at(TimeNs t, std::uint16_t object = 0) const { return at_of_light(t, light_of(object)); }
  double at_of_light(TimeNs t, std::size_t light) const { return lights_[light] ? lights_[light]->at(t) : 1; }

  /// Integrals of a light from t0 to t1.
  Modulation::Integrals integrals(TimeNs t0, TimeNs t1, std::size_t light) const;

  /// The first node of a light after t (Modulation::next_node).
  TimeNs next_node(TimeNs t, std::size_t light) const;

 private:
  std::vector<std::optional<Modulation>> lights_;
  std::vector<std::size_t> light_of_object_;
};

}  // namespace esim::inline light
