#pragma once

#include <optional>

#include "esim/core/describe.h"
#include "esim/light/options.h"

namespace esim::inline scenario {

/// The light of a scene.
struct LightOptions {
  std::optional<FlickerOptions> flicker;  ///< unset: constant light
};

template <class Visitor>
void describe(Visitor& visit, LightOptions& o) {
  visit("flicker", o.flicker,
        About{"flicker of the light that falls on the scene; {} gives default values (default: constant light)"});
}

}  // namespace esim::inline scenario
