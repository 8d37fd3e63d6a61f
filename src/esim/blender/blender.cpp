#include "esim/blender/blender.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "esim/blender/process.h"
#include "esim/blender/script.h"
#include "esim/blender/scripts.h"
#include "esim/core/error.h"

namespace esim::inline blender {
namespace {

namespace fs = std::filesystem;

/// Runs a script in Blender that writes `glb`. It prints "esim progress FRACTION WHAT" or "esim warning TEXT".
bool run_script(const fs::path& scene, const std::string& script, const std::vector<std::string>& arguments,
                const fs::path& glb, const BlenderWatch& watch) {
  const std::string program = blender_program(scene);
  std::error_code error;
  if (!fs::is_regular_file(scene, error)) throw UserError(fmt::format("scene {}: no such file", scene.string()));

  const fs::path folder = fs::absolute(glb).parent_path();
  const ScratchFolder scratch(folder);
  const fs::path result = scratch.path() / "scene.glb";
  std::vector<std::string> all = {fs::absolute(scene).string(), result.string()};
  all.insert(all.end(), arguments.begin(), arguments.end());
  const ScriptInMemory in_memory(script);
  const std::vector<std::string> command = blender_command(program, in_memory, all);

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

}  // namespace esim::inline blender
