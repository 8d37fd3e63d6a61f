#include "terminal.h"

#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>

#include "esim/core/error.h"

namespace esim::app {
namespace {

constexpr std::string_view kEnter = "\033[?1049h\033[?25l\033[2J";  // alternate screen, no cursor, clear
constexpr std::string_view kLeave = "\033[0m\033[?25h\033[?1049l";

// Signals that end the process without unwinding it; Ctrl-C, SIGTERM and SIGHUP are caught elsewhere.
constexpr std::array kDeadly{SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGQUIT, SIGSEGV};

termios before;
std::array<struct sigaction, kDeadly.size()> handlers_before;

/// Async-signal-safe.
void restore() {
  [[maybe_unused]] const auto written = ::write(STDOUT_FILENO, kLeave.data(), kLeave.size());
  tcsetattr(STDIN_FILENO, TCSANOW, &before);
}

void restore_and_die(int signal) {
  restore();
  raise(signal);  // its handler has been reset
}

}  // namespace

bool Terminal::is_there() { return isatty(STDIN_FILENO) == 1 && isatty(STDOUT_FILENO) == 1; }

Terminal::Terminal() {
  if (!is_there() || tcgetattr(STDIN_FILENO, &before) != 0)
    throw UserError("standard input and output must be a terminal; run this in a terminal, without redirection");
  struct sigaction dying {};
  dying.sa_handler = restore_and_die;
  dying.sa_flags = SA_RESETHAND | SA_NODEFER;
  for (std::size_t i = 0; i < kDeadly.size(); ++i) sigaction(kDeadly[i], &dying, &handlers_before[i]);

  termios raw = before;
  raw.c_lflag &= ~static_cast<tcflag_t>(ECHO | ICANON | IEXTEN);  // Ctrl-C stays a signal
  raw.c_iflag &= ~static_cast<tcflag_t>(IXON | ICRNL);
  raw.c_cc[VSUSP] = raw.c_cc[VQUIT] = _POSIX_VDISABLE;
  raw.c_cc[VMIN] = raw.c_cc[VTIME] = 0;
  tcsetattr(STDIN_FILENO, TCSANOW, &raw);
  write(kEnter);
}

Terminal::~Terminal() {
  restore();
  for (std::size_t i = 0; i < kDeadly.size(); ++i) sigaction(kDeadly[i], &handlers_before[i], nullptr);
}

Terminal::Size Terminal::size() const {
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0 || size.ws_row == 0) return {};
  return {size.ws_col, size.ws_row};
}

TerminalColours Terminal::colours() const {
  const char* const value = std::getenv("COLORTERM");
  const std::string_view name = value == nullptr ? "" : value;
  return name == "truecolor" || name == "24bit" ? TerminalColours::direct : TerminalColours::indexed;
}

std::string Terminal::read(int wait_ms) {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  if (poll(&input, 1, wait_ms) <= 0) return {};
  std::array<char, 1024> bytes;
  const ssize_t count = ::read(STDIN_FILENO, bytes.data(), bytes.size());
  if (count <= 0) {
    closed_ = count == 0 || (errno != EINTR && errno != EAGAIN);
    return {};
  }
  return {bytes.data(), static_cast<std::size_t>(count)};
}

void Terminal::write(std::string_view text) {
  while (!text.empty()) {
    const ssize_t count = ::write(STDOUT_FILENO, text.data(), text.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      closed_ = true;
      return;
    }
    text.remove_prefix(static_cast<std::size_t>(count));
  }
}

}  // namespace esim::app
