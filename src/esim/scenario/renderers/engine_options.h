#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "esim/core/describe.h"
#include "esim/scenario/trajectory_options.h"
#include "esim/scene/engine_images.h"

/// Renderers that are other programs.
namespace esim::inline scenario {

/// An object in another program's scene that esim moves.
struct EngineObjectOptions {
  std::string name;
  TrajectoryOptions trajectory;
};

template <class Visitor>
void describe(Visitor& visit, EngineObjectOptions& o) {
  visit("name", o.name, About{"name of the object in that program"});
  visit("trajectory", o.trajectory, About{"motion: pose of its frame (x forward, y left, z up) in the world"});
}

/// A program that speaks UnrealCV's protocol.
struct UnrealcvRendererOptions {
  static constexpr const char* kType = "unrealcv";
  std::string host = "127.0.0.1";
  int port = 9000;
  double timeout_s = 10;
  int camera = 0;
  std::vector<EngineObjectOptions> objects;
  EngineLight light = EngineLight::automatic;
  double exposure = 1.0;
  EngineDepth depth = EngineDepth::automatic;
  EngineMask object_mask = EngineMask::automatic;
  bool pipelined = true;
  int lag_frames = 0;
};

template <class Visitor>
void describe(Visitor& visit, UnrealcvRendererOptions& o) {
  visit("host", o.host, About{"host that runs the program (default: 127.0.0.1)"});
  visit("port", o.port, About{"port on which the program listens", "", 1, 65535});
  visit(
      "timeout_s", o.timeout_s,
      About{"maximum wait for the connection, for each answer, and for a program that restarts", "s", 0, 86400, true});
  visit("camera", o.camera,
        About{"id of the program's camera that esim moves; it serves all cameras of the rig", "", 0, 1e6});
  visit("objects", o.objects, About{"objects of the program's scene that esim moves: a list of maps of"});
  visit("light", o.light, About{"format of requested images; auto: npy if the program offers it, png otherwise"});
  visit("exposure", o.exposure, About{"factor from the program's linear intensity to irradiance", "", 0, 1e6, true});
  visit("depth", o.depth,
        About{"which depth esim requests, and its meaning; auto: plane_depth if the program offers it, otherwise as "
              "usual for its version"});
  visit("object_mask", o.object_mask,
        About{"format of requested object masks; none: the motion field treats all objects as static"});
  visit("pipelined", o.pipelined,
        About{"whether esim sends all commands of a frame together instead of waiting for each answer"});
  visit("lag_frames", o.lag_frames,
        About{"images to discard after each move, for programs that show a move late", "", 0, 100});
}

enum class BlenderEngine { cycles, eevee };

/// Blender, which esim starts or which runs already.
struct BlenderRendererOptions {
  static constexpr const char* kType = "blender";
  std::filesystem::path scene;
  std::string address;
  BlenderEngine engine = BlenderEngine::cycles;
  int samples = 16;
  int noise_seed = 0;
  int threads = 0;
  std::vector<EngineObjectOptions> objects;
  double exposure = 1.0;
  double timeout_s = 600;
};

template <class Visitor>
void describe(Visitor& visit, BlenderRendererOptions& o) {
  visit("scene", o.scene, About{"file that Blender opens: .blend, .glb, .obj, .ply, .fbx or .dae"});
  visit("address", o.address,
        About{"HOST:PORT of a Blender that already serves; esim then starts none, and that Blender determines scene, "
              "engine, noise_seed and threads"});
  visit("engine", o.engine, About{"cycles: path tracing; eevee: Blender's rasteriser"});
  visit("samples", o.samples,
        About{"light paths per pixel of the sensor; supersampled keyframes divide them among their pixels", "", 1,
              65536});
  visit("noise_seed", o.noise_seed, About{"seed of the path tracer", "", 0, 2147483647});
  visit("threads", o.threads, About{"number of Blender's render threads; 0: all processors", "", 0, 1024});
  visit("objects", o.objects, About{"objects of the scene that esim moves: a list of maps of"});
  visit("exposure", o.exposure, About{"factor from Blender's linear intensity to irradiance", "", 0, 1e6, true});
  visit("timeout_s", o.timeout_s,
        About{"maximum wait for Blender to open the scene, and for each image", "s", 0, 86400, true});
}

}  // namespace esim::inline scenario

namespace esim {

template <>
inline constexpr std::array<const char*, 2> kEnumNames<BlenderEngine>{"cycles", "eevee"};
template <>
inline constexpr std::array<const char*, 3> kEnumNames<EngineLight>{"auto", "png", "npy"};
template <>
inline constexpr std::array<const char*, 6> kEnumNames<EngineDepth>{"auto",   "plane_depth", "ray_m",
                                                                    "ray_cm", "planar_m",    "planar_cm"};
template <>
inline constexpr std::array<const char*, 4> kEnumNames<EngineMask>{"auto", "png", "npy", "none"};

}  // namespace esim
