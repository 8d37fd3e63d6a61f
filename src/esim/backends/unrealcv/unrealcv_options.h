#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "esim/scene/engine_images.h"

namespace esim::inline backends::inline unrealcv {

/// The address of a program with UnrealCV's protocol, and how to communicate with it.
struct UnrealcvOptions {
  std::string name = "unrealcv";  ///< name of the renderer in messages and reports
  std::string host = "127.0.0.1";
  int port = 9000;
  double timeout_s = 10;            ///< for a connection, for each answer, and for reconnecting
  int camera = 0;                   ///< id of the program's camera that is moved
  bool pipelined = true;            ///< send a frame's commands together, not each after the answer to the previous one
  int lag_frames = 0;               ///< images that are requested and discarded after each pose
  std::string light_image = "lit";  ///< name of the image with light; esim's Blender server also has "luminance"
  EngineLight light = EngineLight::automatic;
  EngineDepth depth = EngineDepth::automatic;
  EngineMask mask = EngineMask::automatic;
  double exposure = 1;               ///< factor from the program's light to irradiance
  std::vector<std::string> objects;  ///< names of the moving objects, in the order of RenderRequest::objects

  /// Why the program has ended; empty while it runs, or if it is unknown.
  std::function<std::optional<std::string>()> why_ended = [] { return std::nullopt; };
};

}  // namespace esim::inline backends::inline unrealcv
