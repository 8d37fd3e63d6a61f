#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "esim/compose/compose.h"
#include "esim/recording/format.h"

namespace esim::app {

/// From now on, Ctrl-C, SIGTERM and SIGHUP (a lost connection; unless nohup ignores it) only set interrupted(), and
/// SIGPIPE is ignored.
void catch_interrupts();
bool interrupted();

/// Whether this process ignores a signal.
bool is_ignored(int signal);

void write_or_not(std::FILE* file, const std::string& text) noexcept;

/// Prints text for users. Unlike fmt::print, does not throw if the terminal is gone or the pipe is closed, so that
/// files are still completed.
template <typename... Arguments>
void tell(std::FILE* file, fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  write_or_not(file, fmt::format(format, std::forward<Arguments>(arguments)...));
}

/// Prints warnings and, unless `quiet`, notes.
Notices printing(bool quiet);

/// The same; also appends both to `given` for the report.
Notices print_and_keep(std::vector<std::string>& given, bool quiet);

/// The common options of commands that make recordings.
struct RunOptions {
  std::vector<std::string> overrides;
  int threads = 0;
  bool quiet = false;
  bool force = false;
};

/// Adds them to a command; `set_help` is the help of --set.
void add_run_options(CLI::App& command, RunOptions& options, const std::string& set_help);

/// Adds --width and --height of the sensor, for files that do not contain it.
void add_sensor_options(CLI::App& command, std::optional<SensorSize>& sensor);

/// The folder share/esim/NAME of this program: installed, or next to it in an unpacked archive; in the build tree
/// `built`, as seen from the program. The first of them that contains `file`; the installed one if none does.
std::filesystem::path data_folder(const std::string& name, const std::string& built, const std::string& file);

void write_text(const std::filesystem::path& path, const std::string& text);

}  // namespace esim::app
