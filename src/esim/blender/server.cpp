#include "esim/blender/server.h"

#include <fmt/format.h>

#include <charconv>

#include "esim/blender/process.h"
#include "esim/blender/script.h"
#include "esim/blender/scripts.h"
#include "esim/core/error.h"

namespace esim::inline blender {

namespace fs = std::filesystem;

namespace {

constexpr const char* kHowToGetOpenGl =
    " (Eevee requires OpenGL, which may run in software: install libegl1 and libgl1-mesa-dri, or use engine: cycles)";

}  // namespace

struct BlenderServer::Parts {
  explicit Parts(const BlenderServerOptions& options)
      : process(
            blender_command(blender_program(options.scene), script,
                            {"--scene", fs::absolute(options.scene).string(), "--port", "0", "--engine",
                             options.eevee ? "eevee" : "cycles", "--samples", std::to_string(options.samples), "--seed",
                             std::to_string(options.seed), "--threads", std::to_string(options.threads)})),
        needs_opengl(options.eevee) {}

  ScriptInMemory script{std::string(kCommonScript) + kServeScript};
  RunningProcess process;
  bool needs_opengl;
};

BlenderServer::BlenderServer(const BlenderServerOptions& options, const BlenderNotice& warning) {
  std::error_code error;
  blender_program(options.scene);
  if (!fs::is_regular_file(options.scene, error))
    throw UserError(fmt::format("scene {}: no such file", options.scene.string()));
  use(options.scene);
  parts_ = std::make_unique<Parts>(options);
  const bool serves = parts_->process.read_until(
      [&](const std::string& line) {
        constexpr std::string_view kServing = "esim serving 127.0.0.1:", kWarning = "esim warning ",
                                   kFile = "esim warning file ";
        if (line.starts_with(kFile)) {
          use(line.substr(kFile.size()));
        } else if (line.starts_with(kWarning)) {
          warning(line.substr(kWarning.size()));
        }
        if (line.starts_with(kServing))
          std::from_chars(line.data() + kServing.size(), line.data() + line.size(), port_);
        return port_ == 0;
      },
      options.timeout_s);
  if (serves) return;
  if (const auto why = why_ended()) throw UserError(fmt::format("scene {}: {}", options.scene.string(), *why));
  throw UserError(
      fmt::format("scene {}: Blender did not open it within {:g} s; increase renderer.timeout_s, or check it "
                  "in Blender: {}",
                  options.scene.string(), options.timeout_s, reason_in(parts_->process.output_tail())));
}

BlenderServer::~BlenderServer() = default;

/// Notes a file or a folder, if it exists.
void BlenderServer::use(const fs::path& file) {
  std::error_code error;
  if (!fs::exists(file, error)) return;
  files_.push_back(used_file(file));
  if (files_.back().regular) note_used(file);
}

std::optional<std::string> BlenderServer::why_ended() {
  const auto status = parts_->process.exit_status();
  if (!status) return std::nullopt;
  const std::string reason = reason_in(parts_->process.output_tail());
  return fmt::format("Blender failed (exit status {}): {}{}", *status, reason,
                     parts_->needs_opengl && reason.find("GL") != std::string::npos ? kHowToGetOpenGl : "");
}

}  // namespace esim::inline blender
