#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace esim {

/// How far Blender is: from 0 to 1, and at what. Returning false ends it.
using BlenderProgress = std::function<bool(double fraction, const std::string& what)>;

/// Receives one line that the user should know.
using BlenderNotice = std::function<void(const std::string&)>;

/// Who follows what Blender does.
struct BlenderWatch {
  BlenderProgress progress = [](double, const std::string&) { return true; };
  BlenderNotice warning = [](const std::string&) {};
};

struct BakeOptions {
  int samples = 64;    ///< light paths per texel
  int size_px = 1024;  ///< largest side of an object's texture
};

/// Whether a file is to be opened by Blender.
bool is_blend(const std::filesystem::path& file);

// All of these run Debian's `blender`, or the program that the environment variable ESIM_BLENDER names, without a
// display, without the user's settings, and without the scripts that a .blend may hold. They throw UserError where
// there is none, saying how to install it, and where it fails, with what it said. A file appears whole or not at all.

/// Writes what a .blend file's scene shows as GLB: meshes with their modifiers applied, materials, textures, cameras,
/// and the animation, one key per frame. False if `watch` ended it.
bool export_blend(const std::filesystem::path& blend, const std::filesystem::path& glb, const BlenderWatch& watch);

/// The same of any scene file, with the light that falls on its surfaces computed by Cycles and baked into one texture
/// per object; its materials are unlit.
bool bake_scene(const std::filesystem::path& scene, const std::filesystem::path& glb, const BakeOptions& options,
                const BlenderWatch& watch);

/// The GLB of a .blend file, from the cache: exported when neither the .blend, the files it refers to, nor the exporter
/// have changed since. The cache is $XDG_CACHE_HOME/esim, or ~/.cache/esim.
std::filesystem::path cached_glb(const std::filesystem::path& blend, const BlenderWatch& watch);

}  // namespace esim
