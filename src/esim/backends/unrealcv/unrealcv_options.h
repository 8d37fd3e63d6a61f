#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "esim/scene/engine_images.h"

namespace esim {

/// Where a program that speaks UnrealCV's protocol is, and how it is spoken to.
struct UnrealcvOptions {
  std::string name = "unrealcv";  ///< of the renderer, for messages and reports
  std::string host = "127.0.0.1";
  int port = 9000;
  double timeout_s = 10;  ///< longest wait for a connection, for each answer, and for a server that has gone away
  int camera = 0;         ///< id of the camera there that is moved about
  bool pipelined = true;  ///< a frame's commands are sent together, not each after the answer to the one before
  int lag_frames = 0;     ///< images that are asked for and thrown away after each pose
  std::string light_image = "lit";  ///< what light is called; our server in Blender has "luminance" as well
  EngineLight light = EngineLight::automatic;
  EngineDepth depth = EngineDepth::automatic;
  EngineMask mask = EngineMask::automatic;
  double exposure = 1;               ///< factor from the program's light to irradiance
  std::vector<std::string> objects;  ///< names of what moves, in the order of RenderRequest::objects

  /// Why the program has ended; nothing while it runs, or where that is not known.
  std::function<std::optional<std::string>()> why_ended = [] { return std::nullopt; };
};

}  // namespace esim
