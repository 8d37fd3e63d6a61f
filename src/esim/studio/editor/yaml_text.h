#pragma once

#include <string>

#include "esim/studio/server/json.h"

// Private to studio.
namespace esim::studio {

/// The options of a scenario's text as nested JSON: quoted values are text, numbers are numbers. Throws UserError for
/// text that is not YAML, is not a map, or contains itself.
Json values_of(const std::string& yaml, const std::string& name);

/// The text with one option, given by its dotted key, set to a value, or removed if the value is null. Everything else,
/// including comments and spaces, is kept if possible; otherwise the text is rewritten without comments. Missing maps
/// are created; a number one beyond the end of a list adds an entry. Throws UserError if the text is not YAML or the
/// key is invalid.
std::string with_option(const std::string& yaml, const std::string& key, const Json& value);

/// A value as YAML on one line.
std::string yaml_of(const Json& value);

}  // namespace esim::studio
