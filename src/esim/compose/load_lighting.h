#pragma once

#include <optional>

#include "esim/compose/compose.h"
#include "esim/scenario/renderers/lighting_options.h"
#include "esim/scene/scene.h"

// Private to compose.
namespace esim::inline compose {

/// What must be loaded of the scene's materials.
SurfaceModel surface_model(const LightingOptions& options);

/// The lights that a scenario describes; empty if surfaces are unlit. `scene` has all objects. Reads the image of an
/// environment, except for viewers. Throws UserError, naming the option, for values out of range.
std::optional<Lighting> load_lighting(const LightingOptions& options, const Scene& scene, SceneLook look);

/// Says what sampling by the motion field cannot see: highlights, mirrored surroundings, and lights that change.
void name_unsampled_light(const Scenario& scenario, const Scene& scene, const Notices& notices);

}  // namespace esim::inline compose
