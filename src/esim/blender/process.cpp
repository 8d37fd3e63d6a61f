#include "esim/blender/process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <sstream>

#include "esim/core/error.h"

namespace esim {
namespace {

constexpr std::size_t kTailLines = 40, kLongestLine = 2000;

/// In the new process: becomes the program. Only calls that are allowed after a fork.
[[noreturn]] void become(char* const* arguments, int output) {
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (const int nothing = ::open("/dev/null", O_RDONLY); nothing >= 0) ::dup2(nothing, STDIN_FILENO);
  ::dup2(output, STDOUT_FILENO);
  ::dup2(output, STDERR_FILENO);
  ::signal(SIGINT, SIG_DFL);
  ::signal(SIGTERM, SIG_DFL);
  ::execv(arguments[0], arguments);
  ::_exit(127);
}

/// Splits what a program writes into lines, and keeps the last of them.
class Lines {
 public:
  explicit Lines(const LineHandler& on_line) : on_line_(on_line) {}

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
    tail_.push_back(line_);
    if (tail_.size() > kTailLines) tail_.pop_front();
    const bool go_on = on_line_(line_);
    line_.clear();
    return go_on;
  }

  std::string tail() const {
    std::string text;
    for (const std::string& line : tail_) text += line + "\n";
    return text;
  }

 private:
  const LineHandler& on_line_;
  std::string line_;
  std::deque<std::string> tail_;
};

/// Ends a process and those that it started: politely first.
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

std::string find_program(const std::string& name) {
  if (name.find('/') != std::string::npos) return ::access(name.c_str(), X_OK) == 0 ? name : "";
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const std::string candidate = (folder.empty() ? "." : folder) + "/" + name;
    if (::access(candidate.c_str(), X_OK) == 0) return candidate;
  }
  return "";
}

ProcessResult run_process(const std::vector<std::string>& command, const LineHandler& on_line) {
  int pipe[2];
  if (::pipe2(pipe, O_CLOEXEC) != 0) throw InternalError(std::string("cannot make a pipe: ") + std::strerror(errno));
  std::vector<char*> arguments;
  for (const std::string& argument : command) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  const pid_t child = ::fork();
  if (child == 0) become(arguments.data(), pipe[1]);
  ::close(pipe[1]);
  if (child < 0) {
    ::close(pipe[0]);
    throw UserError(command.front() + ": cannot be started: " + std::strerror(errno));
  }

  // Until the program has closed its output, which it does when it ends.
  Lines lines(on_line);
  ProcessResult result;
  std::string buffer(1 << 16, '\0');
  while (true) {
    pollfd waiting{pipe[0], POLLIN, 0};
    const int ready = ::poll(&waiting, 1, 100);
    bool go_on = on_line("");
    if (ready > 0) {
      const ssize_t count = ::read(pipe[0], buffer.data(), buffer.size());
      if (count == 0) break;
      if (count > 0) go_on = lines.take(buffer.data(), static_cast<std::size_t>(count)) && go_on;
    }
    if (go_on) continue;
    result.cancelled = true;
    end_group(child);
    break;
  }
  ::close(pipe[0]);
  lines.finish();

  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  result.exit_status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  result.output_tail = lines.tail();
  return result;
}

}  // namespace esim
