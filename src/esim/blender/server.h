#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "esim/blender/blender.h"
#include "esim/core/inputs/used_files.h"

namespace esim::inline blender {

struct BlenderServerOptions {
  std::filesystem::path scene;
  bool eevee = false;      ///< Blender's rasteriser instead of its path tracer, Cycles
  int samples = 16;        ///< per pixel, until a client sets it
  int seed = 0;            ///< seed of the path tracer's noise
  int threads = 0;         ///< 0: one per processor
  double timeout_s = 120;  ///< for Blender to open the scene
};

/// A background Blender that renders a scene for a client with UnrealCV's protocol. It ends with this object.
class BlenderServer {
 public:
  /// Starts Blender and waits until it serves. Throws UserError if Blender is missing, with how to install it, if the
  /// file does not exist, or if Blender fails, with its message.
  BlenderServer(const BlenderServerOptions& options, const BlenderNotice& warning);
  ~BlenderServer();
  BlenderServer(const BlenderServer&) = delete;
  BlenderServer& operator=(const BlenderServer&) = delete;

  /// The TCP port, on the loopback interface only.
  int port() const { return port_; }

  /// The scene, and everything to which a .blend refers: files, and folders in which Blender chooses files.
  const std::vector<UsedFile>& files() const { return files_; }

  /// Why it ended, on one line; empty while it runs.
  std::optional<std::string> why_ended();

 private:
  struct Parts;
  void use(const std::filesystem::path& file);

  std::unique_ptr<Parts> parts_;
  std::vector<UsedFile> files_;
  int port_ = 0;
};

}  // namespace esim::inline blender
