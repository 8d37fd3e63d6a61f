#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "esim/core/remedy.h"

namespace esim::app {

/// A message with the flag that brings the remedy, where the command has it: `command`, or the one that was given to
/// it.
std::string with_remedy(const std::string& message, Remedy remedy, const CLI::App& command);

}  // namespace esim::app
