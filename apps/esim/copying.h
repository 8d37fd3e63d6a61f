#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <optional>
#include <string>

#include "esim/formats/copy_recording.h"

namespace esim::app {

/// The arguments of commands that copy a recording from any format to any other.
struct CopyArguments {
  std::string input, out, format;
  CopyOptions copy;
  std::optional<SensorSize> sensor;
  bool recover = false, quiet = false, force = false;
};

/// Adds --format, --camera, --from-zero, ..., --force to a command. `does` is what it does: "Convert".
void add_copy_options(CLI::App& command, CopyArguments& arguments, const std::string& does);

/// Copies a recording: calls `copy` with the format and the options, shows the progress, and prints losses. Ctrl-C
/// stops it. Returns the exit code.
int run_copy(const CopyArguments& arguments, const CLI::App& command,
             const std::function<CopySummary(const Format&, const ConvertOptions&,
                                             const std::function<bool(double)>& go_on)>& copy);

}  // namespace esim::app
