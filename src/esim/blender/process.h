#pragma once

#include <functional>
#include <string>
#include <vector>

namespace esim {

/// How another program ended, and what it said.
struct ProcessResult {
  int exit_status = 0;      ///< 128 + the signal's number where a signal ended it
  bool cancelled = false;   ///< `on_line` wished so
  std::string output_tail;  ///< the last lines of both its output streams
};

/// Receives each line of output as it comes, and empty ones now and then; false ends the program.
using LineHandler = std::function<bool(const std::string&)>;

/// Runs a program to its end, with no input. Ends it, and whatever it has started, when `on_line` says so or this
/// process dies. Throws UserError where it cannot be started.
ProcessResult run_process(const std::vector<std::string>& command, const LineHandler& on_line);

/// Where a program is: `name` itself if it has a slash, or else the first match on PATH; empty where there is none.
std::string find_program(const std::string& name);

}  // namespace esim
