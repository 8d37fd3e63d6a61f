#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "esim/core/remedy.h"

namespace esim::app {

/// A message followed by the flag that solves the problem, if `command` or its subcommand has this flag.
std::string with_remedy(const std::string& message, Remedy remedy, const CLI::App& command);

/// The problem with the command line, and the command whose --help tells more. For an unknown command or option, the
/// most similar one.
std::string problem_of(const CLI::ParseError& error, const CLI::App& app);

}  // namespace esim::app
