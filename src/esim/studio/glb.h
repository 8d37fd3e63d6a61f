#pragma once

#include <string>
#include <vector>

#include "esim/core/image.h"
#include "esim/scene/planes.h"
#include "esim/scene/scene.h"

namespace esim::studio {

/// A scene for a browser to draw.
struct Glb {
  std::string bytes;               ///< glTF 2.0, binary; in the scene's own axes, z up
  std::vector<std::string> nodes;  ///< of the objects, in their order
};

/// One node per object, in its own frame; unlit where the scene has no light. Textures are JPEG, at most 2048 px wide
/// and high; what is brighter than white is white. For scenes in colour, or in luminance alone.
Glb make_glb(const Scene& scene);

/// The most triangles that a browser is asked to draw.
inline constexpr std::size_t kMostTriangles = std::size_t{4} << 20;

/// An image for a browser: sRGB, at most `longest` px wide and high. Of one plane or three.
std::string make_jpeg(const Planes& linear, int longest);

}  // namespace esim::studio
