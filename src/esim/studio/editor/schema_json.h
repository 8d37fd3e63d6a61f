#pragma once

#include "esim/studio/server/json.h"

// Private to studio.
namespace esim::studio {

/// All options of a scenario as a tree for forms: {kind: "group", name, help, members: [...]}, made from their
/// descriptions. A leaf has {name, kind: number | integer | boolean | text | path | vector | choice, help, unit, low,
/// high, positive (the low end itself is not allowed), default, choices}, and `optional` if it may be unset. A list has
/// the `element` of its entries, a variant {tag: "type", options: [{name, members}]}.
Json schema_json();

/// The presets of the event camera: [{name, help, values}].
Json presets_json();

}  // namespace esim::studio
