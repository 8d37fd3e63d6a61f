#include "esim/video/model_process.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <utility>
#include <vector>

#include "esim/core/error.h"
#include "esim/core/inputs/used_files.h"
#include "esim/core/programs/program.h"

namespace esim::inline video {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRequirements =
    "models need a Python with the package of esim (docs/install.md) and with onnxruntime (pip install onnxruntime); "
    "the environment variable ESIM_PYTHON names another Python";

/// Runs the module esim.interpolators like `python3 -m`, but never what the current folder calls esim or numpy. (Python
/// has an option for that from 3.11 on.)
constexpr const char* kRun =
    "import runpy, sys; sys.path = [folder for folder in sys.path if folder]; "
    "runpy.run_module('esim.interpolators', run_name='__main__', alter_sys=True)";

/// A process at the other end of a socket.
class Process {
 public:
  explicit Process(const std::vector<std::string>& command) {
    std::array<int, 2> sockets{};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets.data()) != 0)
      throw InternalError(std::string("cannot create a socket: ") + std::strerror(errno));
    try {
      // What it prints goes to the standard error.
      child_ = start_program(command, {sockets[1], STDERR_FILENO, STDERR_FILENO});
    } catch (...) {
      ::close(sockets[0]), ::close(sockets[1]);
      throw;
    }
    ::close(sockets[1]);
    socket_ = sockets[0];
  }
  ~Process() {
    ::close(socket_);
    if (child_ < 0) return;
    ::kill(-child_, SIGKILL);
    wait_for_program(child_);
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
    if (child_ >= 0) exit_status_ = wait_for_program(std::exchange(child_, -1));
    return exit_status_ > 128 ? fmt::format("ended by signal {}", exit_status_ - 128)
                              : fmt::format("ended with exit status {}", exit_status_);
  }

 private:
  pid_t child_ = -1;
  int socket_ = -1, exit_status_ = 0;
};

/// Throws UserError if it is not found.
std::string python_for(const std::string& model) {
  const char* const chosen = std::getenv("ESIM_PYTHON");
  const std::string name = chosen != nullptr && *chosen != '\0' ? chosen : "python3";
  const std::string program = find_program(name);
  if (program.empty()) throw UserError(fmt::format("{}: {} was not found; {}", model, name, kRequirements));
  return program;
}

/// Both sides send their numbers as they lie in memory. A request is the fraction as a double, and the planes of the
/// two frames as floats. An answer is the number of bytes of an error message, 32 bits, followed by that message; or by
/// the planes of the image if the number is 0. The first answer, without an image, comes when the model is loaded.
class ModelProcess final : public FrameInterpolator {
 public:
  ModelProcess(const fs::path& model, int width, int height, bool colour)
      : model_(model.string()),
        python_(python_for(model_)),
        width_(width),
        height_(height),
        colour_(colour),
        process_({python_, "-c", kRun, model_, std::to_string(width), std::to_string(height), colour ? "3" : "1"}) {
    std::uint32_t error_bytes = 0;
    if (!process_.receive(&error_bytes, sizeof(error_bytes))) {
      throw UserError(fmt::format("{}: {} {} before it was ready; {}", model_, python_, process_.end(), kRequirements));
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
