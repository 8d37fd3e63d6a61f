#pragma once

#include <memory>
#include <string>
#include <vector>

#include "esim/core/parallel.h"
#include "esim/scene/scene.h"

namespace esim::studio {

/// A scene for a browser to draw.
struct Glb {
  std::string bytes;               ///< glTF 2.0, binary; in the scene's own axes, z up
  std::vector<std::string> nodes;  ///< of the objects, in their order

  /// What its textures show, in their order: the images in `bytes` are small, for the first picture. Where the file is
  /// larger, the image's `extras` have `image`, its index here.
  std::vector<std::shared_ptr<const CodedTexture>> images;
};

/// One node per object, in its own frame; unlit where the scene has no light. Of scenes of more than 100 000 triangles
/// each primitive's `extras` have `coarse`, an accessor of the indices of far fewer triangles between the same
/// vertices. For scenes of SceneLook::coded.
Glb make_glb(const Scene& scene, const Workers& workers);

/// The most triangles that a browser is asked to draw.
inline constexpr std::size_t kMostTriangles = std::size_t{4} << 20;

}  // namespace esim::studio
