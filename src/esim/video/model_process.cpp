#include "esim/video/model_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "esim/core/error.h"
#include "esim/core/inputs/used_files.h"

namespace esim::inline video {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRequirements =
    "models need a Python with the package of esim (docs/install.md) and with onnxruntime (pip install onnxruntime); "
    "the "
    "environment variable ESIM_PYTHON names another Python";
constexpr int kNotFound = 127;  // exit status of a process that could not become the program

/// Runs the program in the new process, with the socket as its input. What it prints goes to the standard error.
/// Makes only calls that are allowed after a fork.
[[noreturn]] void become(char* const* arguments, int socket) {
  ::setpgid(0, 0);  // Ctrl-C is for this process, which ends the other one
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::dup2(socket, STDIN_FILENO);
  ::dup2(STDERR_FILENO, STDOUT_FILENO);
  for (const int signal : {SIGINT, SIGTERM, SIGPIPE}) ::signal(signal, SIG_DFL);
  ::execvp(arguments[0], arguments);
  ::_exit(kNotFound);
}

/// A process at the other end of a socket.
class Process {
 public:
  explicit Process(const std::vector<std::string>& command) {
    std::array<int, 2> sockets{};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets.data()) != 0)
      throw InternalError(std::string("cannot create a socket: ") + std::strerror(errno));
    std::vector<char*> arguments;
    for (const std::string& argument : command) arguments.push_back(const_cast<char*>(argument.c_str()));
    arguments.push_back(nullptr);
    child_ = ::fork();
    if (child_ == 0) become(arguments.data(), sockets[1]);
    const int problem = errno;
    ::close(sockets[1]);
    socket_ = sockets[0];
    if (child_ < 0) throw UserError(command.front() + ": cannot be started: " + std::strerror(problem));
  }
  ~Process() {
    ::close(socket_);
    if (child_ <= 0) return;
    ::kill(-child_, SIGKILL);
    wait();
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// False if the process has ended.
  bool send(const void* data, std::size_t bytes) const {
    const char* from = static_cast<const char*>(data);
    while (bytes > 0) {
      const ssize_t sent = ::send(socket_, from, bytes, MSG_NOSIGNAL);
      if (sent < 0 && errno == EINTR) continue;
      if (sent <= 0) return false;
      from += sent;
      bytes -= static_cast<std::size_t>(sent);
    }
    return true;
  }

  bool receive(void* data, std::size_t bytes) const {
    char* to = static_cast<char*>(data);
    while (bytes > 0) {
      const ssize_t came = ::recv(socket_, to, bytes, 0);
      if (came < 0 && errno == EINTR) continue;
      if (came <= 0) return false;
      to += came;
      bytes -= static_cast<std::size_t>(came);
    }
    return true;
  }

  /// How the process ended, which has closed its socket.
  std::string end() {
    const int status = wait();
    if (WIFSIGNALED(status)) return fmt::format("ended by signal {}", WTERMSIG(status));
    return fmt::format("ended with exit status {}", WEXITSTATUS(status));
  }

  bool was_not_found() {
    const int status = wait();
    return WIFEXITED(status) && WEXITSTATUS(status) == kNotFound;
  }

 private:
  int wait() {
    while (child_ > 0 && ::waitpid(child_, &status_, 0) < 0 && errno == EINTR) {
    }
    child_ = -1;
    return status_;
  }

  pid_t child_ = -1;
  int socket_ = -1, status_ = 0;
};

std::string python() {
  const char* const chosen = std::getenv("ESIM_PYTHON");
  return chosen != nullptr && *chosen != '\0' ? chosen : "python3";
}

/// Both sides send their numbers as they lie in memory. A request is the fraction as a double, and the planes of the
/// two frames as floats. An answer is the number of bytes of an error message, 32 bits, followed by that message; or by
/// the planes of the image if the number is 0. The first answer, without an image, comes when the model is loaded.
class ModelProcess final : public FrameInterpolator {
 public:
  ModelProcess(const fs::path& model, int width, int height, bool colour)
      : model_(model.string()),
        python_(python()),
        width_(width),
        height_(height),
        colour_(colour),
        process_({python_, "-m", "esim.interpolators", model_, std::to_string(width), std::to_string(height),
                  colour ? "3" : "1"}) {
    std::uint32_t error_bytes = 0;
    if (!process_.receive(&error_bytes, sizeof(error_bytes))) {
      const std::string reason = process_.was_not_found() ? "was not found" : process_.end() + " before it was ready";
      throw UserError(fmt::format("{}: {} {}; {}", model_, python_, reason, kRequirements));
    }
    if (error_bytes > 0) throw UserError(message(error_bytes));
  }

  std::string name() const override { return "the interpolator " + model_; }

  void between(const Frame& frame0, const Frame& frame1, double fraction, Planes& light) override {
    bool works = process_.send(&fraction, sizeof(fraction));
    for (const Frame* frame : {&frame0, &frame1}) {
      for (const Image<float>& plane : frame->planes)
        works = works && process_.send(plane.pixels().data(), plane.pixels().size_bytes());
    }
    std::uint32_t error_bytes = 0;
    works = works && process_.receive(&error_bytes, sizeof(error_bytes));
    if (works && error_bytes > 0) throw UserError(message(error_bytes));
    resize(light, width_, height_, colour_);
    for (Image<float>& plane : light)
      works = works && process_.receive(plane.pixels().data(), plane.pixels().size_bytes());
    if (!works) throw UserError(fmt::format("its process {} {}", python_, process_.end()));
  }

 private:
  std::string message(std::uint32_t bytes) {
    std::string text(bytes, '\0');
    return process_.receive(text.data(), bytes) ? text : fmt::format("its process {} {}", python_, process_.end());
  }

  std::string model_, python_;
  int width_, height_;
  bool colour_;
  Process process_;
};

}  // namespace

std::unique_ptr<FrameInterpolator> start_model_process(const fs::path& model, int width, int height, bool colour) {
  std::error_code error;
  if (!fs::is_regular_file(model, error)) throw UserError(model.string() + ": no such file; name a model in ONNX");
  note_used(model);
  return std::make_unique<ModelProcess>(model, width, height, colour);
}

}  // namespace esim::inline video
