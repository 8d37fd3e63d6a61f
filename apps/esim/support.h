#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "esim/compose/compose.h"
#include "esim/record/format.h"

namespace esim::app {

/// From now on, Ctrl-C and SIGTERM are only remembered.
void catch_interrupts();
bool interrupted();

/// Prints warnings and, unless `quiet`, notes.
Notices printing(bool quiet);

/// The same; keeps both in `given` for the report.
Notices print_and_keep(std::vector<std::string>& given, bool quiet);

/// What the commands that make recordings have in common.
struct RunOptions {
  std::vector<std::string> overrides;
  int threads = 0;
  bool quiet = false;
  bool force = false;
};

/// Adds them to a command; `set_help` says what --set changes.
void add_run_options(CLI::App& command, RunOptions& options, const std::string& set_help);

/// Adds --width and --height of the sensor, for files that do not tell.
void add_sensor_options(CLI::App& command, std::optional<SensorSize>& sensor);

void write_text(const std::filesystem::path& path, const std::string& text);

}  // namespace esim::app
