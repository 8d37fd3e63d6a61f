#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>

#include "commands.h"
#include "esim/blender/blender.h"
#include "esim/core/error.h"
#include "esim/scene/scene_file.h"
#include "support.h"

namespace esim::app {
namespace {

struct ImportArguments {
  std::string scene;
  std::string out;
  bool bake = false;
  BakeOptions options;
  bool quiet = false;
  bool force = false;
};

/// Blender's current step: one line on a terminal, otherwise a line per step.
class Steps {
 public:
  explicit Steps(bool wanted) : wanted_(wanted), on_terminal_(isatty(STDERR_FILENO) == 1) {}

  void show(double fraction, const std::string& what) {
    const std::string line = fmt::format("[{:3.0f} %] {}", 100 * fraction, what);
    if (!wanted_ || line == shown_) return;
    tell(stderr, "{}{}{}", on_terminal_ ? "\r\033[K" : "", line, on_terminal_ ? "" : "\n");
    std::fflush(stderr);
    shown_ = line;
  }

  void clear() {
    if (wanted_ && on_terminal_) tell(stderr, "\r\033[K");
  }

 private:
  bool wanted_, on_terminal_;
  std::string shown_;
};

std::filesystem::path output_of(const ImportArguments& arguments) {
  const std::filesystem::path scene = arguments.scene;
  std::filesystem::path out = arguments.out;
  if (out.empty()) out = scene.parent_path() / (scene.stem().string() + (arguments.bake ? "_baked.glb" : ".glb"));
  if (out.extension() != ".glb") throw UserError(fmt::format("--out {}: must end in .glb", out.string()));
  std::error_code error;
  if (std::filesystem::equivalent(scene, out, error))
    throw UserError(fmt::format("--out {}: must not be the scene itself; name another file", out.string()));
  if (std::filesystem::exists(out, error) && !arguments.force)
    throw UserError(fmt::format("--out {}: exists; name another file, or replace it with --force", out.string()));
  return out;
}

int run(const ImportArguments& arguments) {
  const std::filesystem::path out = output_of(arguments);
  catch_interrupts();
  Steps steps(!arguments.quiet);
  const auto warn = [&](const std::string& text) {
    if (text.starts_with("file ")) return;  // that the scene refers to
    steps.clear();
    tell(stderr, "warning: {}\n", text);
  };
  BlenderWatch watch;
  watch.warning = warn;
  watch.progress = [&](double fraction, const std::string& what) {
    steps.show(fraction, what);
    return !interrupted();
  };
  const bool done = arguments.bake ? bake_scene(arguments.scene, out, arguments.options, watch)
                                   : export_blend(arguments.scene, out, watch);
  steps.clear();
  if (!done) return kInterrupted;
  tell(stdout, "{}: {}\n", out.string(), summary(load_scene_file(out, warn)));
  return kOk;
}

}  // namespace

void add_import(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<ImportArguments>();
  CLI::App* command = app.add_subcommand(
      "import", "Convert a scene (.blend and others) to GLB with Blender, optionally with baked lighting");
  command->add_option("scene", arguments->scene, "Scene file")->required()->type_name("SCENE");
  command
      ->add_option("-o,--out", arguments->out, "File to write (default: NAME.glb or NAME_baked.glb next to the scene)")
      ->type_name("FILE.glb");
  command->add_flag("--bake", arguments->bake,
                    "Path-trace the lighting with Cycles and bake it into one texture per object");
  command->add_option("--samples", arguments->options.samples, "Light paths per texel; more paths reduce noise")
      ->capture_default_str()
      ->check(CLI::Range(1, 65536));
  command->add_option("--size", arguments->options.size_px, "Maximum side length of an object's texture, px")
      ->capture_default_str()
      ->check(CLI::Range(16, 8192));
  command->add_flag("-q,--quiet", arguments->quiet, "Print warnings and errors only");
  command->add_flag("--force", arguments->force, "Replace an existing file");
  command->footer(
      "Examples:\n  esim import room.blend\n  esim import room.blend --bake --out room_baked.glb --samples 256");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace esim::app
