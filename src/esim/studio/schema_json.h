#pragma once

#include "esim/studio/json.h"

namespace esim::studio {

/// Every option of a scenario as a tree for forms: {kind: "group", name, help, members: [...]}, of the scenario's own
/// descriptions. A leaf has {name, kind: number | integer | boolean | text | path | vector | choice, help, unit, low,
/// high, positive (the low end itself is not allowed), default, choices}; `optional` where it may stay unset. A list
/// has its entries' `element`, a variant {tag: "type", options: [{name, members}]}.
Json schema_json();

/// The presets of the event camera: [{name, help, values}].
Json presets_json();

}  // namespace esim::studio
