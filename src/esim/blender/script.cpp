#include "esim/blender/script.h"

#include <fmt/format.h>
#include <stdlib.h>  // mkdtemp
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "esim/blender/process.h"
#include "esim/core/error.h"
#include "esim/core/programs/program.h"

namespace esim::inline blender {

namespace fs = std::filesystem;

ScratchFolder::ScratchFolder(const fs::path& beside) {
  std::string name = (beside / ".esim_XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) {
    throw OutputError(fmt::format(
        "{}: cannot be written to; check that it exists, that you may write to it, and that the disk has space",
        beside.string()));
  }
  path_ = name;
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

std::string blender_program(const fs::path& scene) {
  const char* const chosen = std::getenv("ESIM_BLENDER");
  const std::string name = chosen != nullptr && *chosen != '\0' ? chosen : "blender";
  std::string program = find_program(name);
  if (!program.empty()) return program;
  throw UserError(fmt::format(
      "scene {}: requires Blender, but the program {} was not found; install it with 'sudo apt install blender', or "
      "export the scene as GLB on a computer that has it",
      scene.string(), name));
}

ScriptInMemory::ScriptInMemory(const std::string& script) : file_(::memfd_create("script.py", 0)) {
  if (file_ < 0 || ::write(file_, script.data(), script.size()) != static_cast<ssize_t>(script.size()))
    throw OutputError(std::string("cannot store a script in memory: ") + std::strerror(errno));
}

ScriptInMemory::~ScriptInMemory() {
  if (file_ >= 0) ::close(file_);
}

std::string ScriptInMemory::path() const { return fmt::format("/proc/self/fd/{}", file_); }

std::vector<std::string> blender_command(const std::string& program, const ScriptInMemory& script,
                                         const std::vector<std::string>& arguments) {
  // Debian's Blender uses the first Python on PATH, which may lack the system's modules.
  const char* const path = std::getenv("PATH");
  std::vector<std::string> command = {
      "/usr/bin/env", "-u",         "PYTHONHOME",
      "-u",           "PYTHONPATH", fmt::format("PATH=/usr/bin:/bin:{}", path != nullptr ? path : "")};
  command.insert(command.end(), {program, "--background", "--factory-startup", "--disable-autoexec"});
  command.insert(command.end(), {"--python-exit-code", "3", "--python", script.path(), "--"});
  command.insert(command.end(), arguments.begin(), arguments.end());
  return command;
}

std::string reason_in(const std::string& output) {
  std::string reason, last;
  std::size_t begin = 0;
  while (begin < output.size()) {
    const std::size_t end = std::min(output.find('\n', begin), output.size());
    const std::string line = output.substr(begin, end - begin);
    begin = end + 1;
    const bool says_nothing = line.find_first_not_of(' ') == std::string::npos || line.starts_with("Blender quit") ||
                              line.find("script failed") != std::string::npos;
    if (says_nothing) continue;
    last = line;
    if (line.find("Error") != std::string::npos || line.find("rror:") != std::string::npos) reason = line;
  }
  return reason.empty() ? last : reason;
}

}  // namespace esim::inline blender
