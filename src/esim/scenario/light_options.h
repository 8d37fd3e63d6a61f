#pragma once

#include <optional>

#include "esim/core/describe.h"
#include "esim/light/options.h"

namespace esim::inline scenario {

/// The light of a scene.
struct LightOptions {
  std::optional<FlickerOptions> flicker;  ///< unset: constant light
  std::optional<double> white_lux;        ///< illuminance of a diffuse white surface at irradiance 1, lux
};

template <class Visitor>
void describe(Visitor& visit, LightOptions& o) {
  visit("flicker", o.flicker,
        About{"flicker of the light that falls on the scene; {} gives default values (default: constant light)"});
  visit(
      "white_lux", o.white_lux,
      About{"illuminance of a diffuse white surface at irradiance 1, for event cameras with a circuit (default: 1000)",
            "lux", 0, 1e9, true});
}

}  // namespace esim::inline scenario
