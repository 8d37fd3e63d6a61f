#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "esim/blender/blender.h"

namespace esim {

struct BlenderServerOptions {
  std::filesystem::path scene;
  bool eevee = false;      ///< Blender's rasteriser instead of its path tracer, Cycles
  int samples = 16;        ///< per pixel, until a client says otherwise
  int seed = 0;            ///< of the path tracer's noise
  int threads = 0;         ///< 0: as many as there are processors
  double timeout_s = 120;  ///< longest wait for Blender to open the scene
};

/// Blender, without a display, showing a scene to a client that speaks UnrealCV's protocol. It ends with this object.
class BlenderServer {
 public:
  /// Starts Blender and waits until it serves. Throws UserError where there is no Blender, saying how to install it, no
  /// such file, or what Blender said where it fails.
  BlenderServer(const BlenderServerOptions& options, const BlenderNotice& warning);
  ~BlenderServer();
  BlenderServer(const BlenderServer&) = delete;
  BlenderServer& operator=(const BlenderServer&) = delete;

  /// On which it listens, on this machine alone.
  int port() const { return port_; }

  /// Why it ended, on one line; nothing while it runs.
  std::optional<std::string> why_ended();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
  int port_ = 0;
};

}  // namespace esim
