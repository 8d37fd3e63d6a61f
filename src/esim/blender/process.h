#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace esim::inline blender {

/// How a program ended, and its output.
struct ProcessResult {
  int exit_status = 0;      ///< 128 + the signal's number if a signal ended it
  bool cancelled = false;   ///< `on_line` ended it
  std::string output_tail;  ///< the last lines of both its output streams
};

/// Receives each line of output immediately, and empty lines regularly; false ends the program.
using LineHandler = std::function<bool(const std::string&)>;

/// Runs a program to its end, without input. Ends it and its child processes if `on_line` returns false or this process
/// ends. Throws UserError if it cannot be started.
ProcessResult run_process(const std::vector<std::string>& command, const LineHandler& on_line);

/// A program that runs in the background, without input. It and its child processes end with this object, or with the
/// thread that created it.
class RunningProcess {
 public:
  /// Throws UserError if it cannot be started.
  explicit RunningProcess(const std::vector<std::string>& command);
  ~RunningProcess();
  RunningProcess(const RunningProcess&) = delete;
  RunningProcess& operator=(const RunningProcess&) = delete;

  /// Reads its output until `on_line` returns false; then returns true and reads the remaining output in the
  /// background. False if the program ends or the time is over first. Call it once.
  bool read_until(const LineHandler& on_line, double timeout_s);

  /// The exit status, as in ProcessResult; empty while it runs.
  std::optional<int> exit_status();

  /// The last lines that it wrote.
  std::string output_tail() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace esim::inline blender
