#pragma once

#include <string>

#include "esim/studio/json.h"

namespace esim::studio {

/// The options that a scenario's text gives, as nested JSON: what is quoted is text, numbers are numbers. Throws
/// UserError for what is no YAML, is no map, or holds itself.
Json values_of(const std::string& yaml, const std::string& name);

/// The text with one option, named by its dotted key, set to a value, or taken out where it is null. All else stays as
/// it was written, comments and spaces too, wherever that can be had: where it cannot, the text is written anew, and
/// comments are lost. Maps that are missing on the way are made; a number one beyond the end of a list is a new entry.
/// Throws UserError where the text is no YAML or the key leads nowhere.
std::string with_option(const std::string& yaml, const std::string& key, const Json& value);

/// A value as YAML on one line.
std::string yaml_of(const Json& value);

}  // namespace esim::studio
