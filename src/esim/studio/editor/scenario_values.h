#pragma once

#include <string>

#include "esim/studio/server/json.h"

// Private to studio.
namespace esim::studio {

/// The options of a scenario's text as nested JSON: quoted values are text, numbers are numbers. `name` is the file in
/// messages. Throws UserError for text that is not YAML, is not a map, or contains itself.
Json values_of(const std::string& yaml, const std::string& name);

}  // namespace esim::studio
