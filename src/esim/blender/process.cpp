#include "esim/blender/process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

#include "esim/core/error.h"
#include "esim/core/programs/program.h"

namespace esim::inline blender {
namespace {

constexpr std::size_t kTailLines = 40, kLongestLine = 2000;

/// Splits what a program writes into lines, and keeps the last of them.
class Lines {
 public:
  explicit Lines(LineHandler on_line) : on_line_(std::move(on_line)) {}

  bool take(const char* data, std::size_t size) {
    bool go_on = true;
    for (const char c : std::string(data, size)) {
      if (c != '\n' && c != '\r') {
        if (line_.size() < kLongestLine) line_ += c;
      } else {
        go_on = finish() && go_on;
      }
    }
    return go_on;
  }

  bool finish() {
    if (line_.empty()) return true;
    {
      const std::lock_guard lock(mutex_);
      tail_.push_back(line_);
      if (tail_.size() > kTailLines) tail_.pop_front();
    }
    const bool go_on = on_line_(line_);
    line_.clear();
    return go_on;
  }

  std::string tail() const {
    const std::lock_guard lock(mutex_);
    std::string text;
    for (const std::string& line : tail_) text += line + "\n";
    return text;
  }

 private:
  LineHandler on_line_;
  std::string line_;
  mutable std::mutex mutex_;  // of tail_
  std::deque<std::string> tail_;
};

struct Started {
  pid_t child = -1;
  int output = -1;  ///< the reading end of both its output streams
};

Started start(const std::vector<std::string>& command) {
  int pipe[2];
  if (::pipe2(pipe, O_CLOEXEC) != 0) throw InternalError(std::string("cannot create a pipe: ") + std::strerror(errno));
  try {
    const Started started{start_program(command, {-1, pipe[1], pipe[1]}), pipe[0]};
    ::close(pipe[1]);
    return started;
  } catch (...) {
    ::close(pipe[0]), ::close(pipe[1]);
    throw;
  }
}

enum class Came { nothing, something, end };

/// Waits up to a tenth of a second for output of a program; clears `go_on` if a handler of `lines` returns false.
Came read_some(int output, Lines& lines, bool& go_on) {
  constexpr int kPatience_ms = 100;
  char buffer[1 << 14];
  pollfd waiting{output, POLLIN, 0};
  if (::poll(&waiting, 1, kPatience_ms) <= 0) return Came::nothing;
  const ssize_t count = ::read(output, buffer, sizeof(buffer));
  if (count == 0) return Came::end;
  if (count > 0) go_on = lines.take(buffer, static_cast<std::size_t>(count)) && go_on;
  return Came::something;
}

/// Ends a process and its child processes, first with SIGTERM.
void end_group(pid_t leader) {
  ::kill(-leader, SIGTERM);
  for (int i = 0; i < 50; ++i) {
    siginfo_t info{};
    if (::waitid(P_PID, static_cast<id_t>(leader), &info, WEXITED | WNOHANG | WNOWAIT) != 0 || info.si_pid != 0) break;
    ::usleep(20'000);
  }
  ::kill(-leader, SIGKILL);
}

}  // namespace

ProcessResult run_process(const std::vector<std::string>& command, const LineHandler& on_line) {
  const Started program = start(command);
  Lines lines(on_line);
  ProcessResult result;
  // Until the program closes its output, at the latest when it ends.
  while (true) {
    bool go_on = on_line("");
    if (read_some(program.output, lines, go_on) == Came::end) break;
    if (go_on) continue;
    result.cancelled = true;
    end_group(program.child);
    break;
  }
  ::close(program.output);
  lines.finish();
  result.exit_status = wait_for_program(program.child);
  result.output_tail = lines.tail();
  return result;
}

struct RunningProcess::State {
  explicit State(const std::vector<std::string>& command) : program(start(command)) {}

  Started program;
  LineHandler on_line = [](const std::string&) { return true; };
  Lines lines{[this](const std::string& line) { return on_line(line); }};
  std::optional<int> exit_status;
  std::atomic<bool> stop = false;
  std::thread reader;
};

RunningProcess::RunningProcess(const std::vector<std::string>& command) : state_(std::make_unique<State>(command)) {}

RunningProcess::~RunningProcess() {
  if (!exit_status()) {
    end_group(state_->program.child);
    wait_for_program(state_->program.child);
  }
  state_->stop = true;
  if (state_->reader.joinable()) state_->reader.join();
  ::close(state_->program.output);
}

bool RunningProcess::read_until(const LineHandler& on_line, double timeout_s) {
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::duration<double>(timeout_s);
  bool go_on = true;
  state_->on_line = on_line;
  while (go_on && std::chrono::steady_clock::now() < give_up) {
    // A program that has closed its output is about to end.
    if (read_some(state_->program.output, state_->lines, go_on) == Came::end && exit_status()) break;
  }
  state_->on_line = [](const std::string&) { return true; };
  if (go_on) return false;
  state_->reader = std::thread([state = state_.get()] {
    bool unused = true;
    while (!state->stop && read_some(state->program.output, state->lines, unused) != Came::end) {
    }
  });
  return true;
}

std::optional<int> RunningProcess::exit_status() {
  int status = 0;
  if (!state_->exit_status && ::waitpid(state_->program.child, &status, WNOHANG) == state_->program.child)
    state_->exit_status = exit_status_of(status);
  return state_->exit_status;
}

std::string RunningProcess::output_tail() const { return state_->lines.tail(); }

}  // namespace esim::inline blender
