#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace esim::inline blender {

/// Receives Blender's progress, from 0 to 1, and its current step. Returning false ends Blender.
using BlenderProgress = std::function<bool(double fraction, const std::string& what)>;

/// Receives a message for the user, as one line.
using BlenderNotice = std::function<void(const std::string&)>;

/// Receives what Blender reports.
struct BlenderWatch {
  BlenderProgress progress = [](double, const std::string&) { return true; };
  BlenderNotice warning = [](const std::string&) {};
};

struct BakeOptions {
  int samples = 64;    ///< light paths per texel
  int size_px = 1024;  ///< largest side of an object's texture
};

/// Whether a file must be opened by Blender.
bool is_blend(const std::filesystem::path& file);

// These functions run `blender`, or the program in the environment variable ESIM_BLENDER, without a display, without
// the user's settings, and without scripts of a .blend file. They throw UserError if Blender is missing, with how to
// install it, and if it fails, with its message. A file is written completely or not at all.

/// Exports the scene of a .blend file as GLB: meshes with their modifiers applied, materials, textures, cameras, and
/// the animation with one key per frame. False if `watch` ended it.
bool export_blend(const std::filesystem::path& blend, const std::filesystem::path& glb, const BlenderWatch& watch);

/// As above, for any scene file, with lighting that Cycles computes by path tracing and bakes into one texture per
/// object. The materials are unlit.
bool bake_scene(const std::filesystem::path& scene, const std::filesystem::path& glb, const BakeOptions& options,
                const BlenderWatch& watch);

/// The folder of esim's caches, which is created: $XDG_CACHE_HOME/esim, or ~/.cache/esim. Throws UserError.
std::filesystem::path cache_folder();

/// The GLB of a .blend file, from the cache; exported again if the .blend, a file to which it refers, or the exporter
/// has changed.
std::filesystem::path cached_glb(const std::filesystem::path& blend, const BlenderWatch& watch);

}  // namespace esim::inline blender
