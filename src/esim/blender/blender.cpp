#include "esim/blender/blender.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <fstream>

#include "esim/blender/process.h"
#include "esim/blender/scripts.h"
#include "esim/core/error.h"

namespace esim {
namespace {

namespace fs = std::filesystem;

/// A folder of its own for one run, gone with the object.
class ScratchFolder {
 public:
  explicit ScratchFolder(const fs::path& beside) {
    std::string name = (beside / ".esim_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr)
      throw OutputError(fmt::format("{}: cannot be written to; check that it exists, its permissions, and the disk",
                                    beside.string()));
    path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

std::string blender_program(const fs::path& scene) {
  const char* const chosen = std::getenv("ESIM_BLENDER");
  const std::string name = chosen != nullptr && *chosen != '\0' ? chosen : "blender";
  std::string program = find_program(name);
  if (!program.empty()) return program;
  throw UserError(
      fmt::format("scene {}: needs Blender, but there is no program {}; install it with 'sudo apt install blender', or "
                  "export the scene as GLB on a machine that has it",
                  scene.string(), name));
}

/// The last of what Blender said that sounds like a reason, on one line.
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

/// Lets Blender run a script that writes `glb`. What it prints is "esim progress FRACTION WHAT" or "esim warning TEXT".
bool run_script(const fs::path& scene, const std::string& script, const std::vector<std::string>& arguments,
                const fs::path& glb, const BlenderWatch& watch) {
  const std::string program = blender_program(scene);
  std::error_code error;
  if (!fs::is_regular_file(scene, error)) throw UserError(fmt::format("scene {}: no such file", scene.string()));

  const fs::path folder = fs::absolute(glb).parent_path();
  const ScratchFolder scratch(folder);
  const fs::path script_file = scratch.path() / "script.py", result = scratch.path() / "scene.glb";
  std::ofstream(script_file) << script;
  // Debian's Blender uses the first Python on PATH, which may be one that lacks the system's modules.
  const char* const path = std::getenv("PATH");
  std::vector<std::string> command = {
      "/usr/bin/env", "-u",         "PYTHONHOME",
      "-u",           "PYTHONPATH", fmt::format("PATH=/usr/bin:/bin:{}", path != nullptr ? path : "")};
  command.insert(command.end(), {program, "--background", "--factory-startup", "--disable-autoexec"});
  command.insert(command.end(), {"--python-exit-code", "3", "--python", script_file.string(), "--"});
  command.insert(command.end(), {fs::absolute(scene).string(), result.string()});
  command.insert(command.end(), arguments.begin(), arguments.end());

  double fraction = 0;
  std::string what = "starting Blender";
  const ProcessResult ended = run_process(command, [&](const std::string& line) {
    constexpr std::string_view kProgress = "esim progress ", kWarning = "esim warning ";
    if (line.starts_with(kWarning)) watch.warning(line.substr(kWarning.size()));
    if (line.starts_with(kProgress)) {
      const char* const number = line.data() + kProgress.size();
      const char* const end = std::from_chars(number, line.data() + line.size(), fraction).ptr;
      what.assign(std::min(end + 1, line.data() + line.size()), line.data() + line.size());
    }
    return watch.progress(fraction, what);
  });
  if (ended.cancelled) return false;
  if (ended.exit_status != 0 || !fs::is_regular_file(result, error)) {
    throw UserError(fmt::format("scene {}: Blender failed (exit status {}): {}", scene.string(), ended.exit_status,
                                reason_in(ended.output_tail)));
  }
  fs::rename(result, glb, error);
  if (error) throw OutputError(fmt::format("cannot write {}: {}", glb.string(), error.message()));
  return true;
}

}  // namespace

bool is_blend(const fs::path& file) { return file.extension() == ".blend"; }

bool export_blend(const fs::path& blend, const fs::path& glb, const BlenderWatch& watch) {
  return run_script(blend, std::string(kCommonScript) + kExportScript, {}, glb, watch);
}

bool bake_scene(const fs::path& scene, const fs::path& glb, const BakeOptions& options, const BlenderWatch& watch) {
  return run_script(scene, std::string(kCommonScript) + kBakeScript,
                    {std::to_string(options.samples), std::to_string(options.size_px)}, glb, watch);
}

}  // namespace esim
