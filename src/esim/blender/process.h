#pragma once

#include <functional>
#include <memory>
#include <optional>
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

/// A program that runs beside this one, with no input. It ends, with whatever it has started, with this object or with
/// the thread that made it.
class RunningProcess {
 public:
  /// Throws UserError where it cannot be started.
  explicit RunningProcess(const std::vector<std::string>& command);
  ~RunningProcess();
  RunningProcess(const RunningProcess&) = delete;
  RunningProcess& operator=(const RunningProcess&) = delete;

  /// Reads its output until `on_line` returns false: then true, and the rest of it is followed in the background. False
  /// where the program ends, or the time is over, before. To be called once.
  bool read_until(const LineHandler& on_line, double timeout_s);

  /// How it ended, once it has; as in ProcessResult.
  std::optional<int> exit_status();

  /// The last lines that it wrote.
  std::string output_tail() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Where a program is: `name` itself if it has a slash, or else the first match on PATH; empty where there is none.
std::string find_program(const std::string& name);

}  // namespace esim
