#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "esim/core/remedy.h"

namespace esim::app {

/// A message followed by the flag that solves the problem, if `command` or its subcommand has this flag.
std::string with_remedy(const std::string& message, Remedy remedy, const CLI::App& command);

}  // namespace esim::app
