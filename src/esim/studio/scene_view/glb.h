#pragma once

#include <memory>
#include <string>
#include <vector>

#include "esim/core/parallel.h"
#include "esim/scene/scene.h"

namespace esim::studio {

/// A scene in a format for browsers.
struct Glb {
  std::string bytes;               ///< binary glTF 2.0, in the scene's axes, z up
  std::vector<std::string> nodes;  ///< of the objects, in their order

  /// Its textures, in order. The images in `bytes` are thumbnails; if the texture is larger, the `extras` of the image
  /// have `image`, the texture's index here.
  std::vector<std::shared_ptr<const CodedTexture>> images;
};

/// One node per object, in the object's frame; unlit if the scene has no lights. Surfaces that shine have their
/// metallic and roughness factors, their textures and normal maps; textures of roughness and of metallic factors that
/// are different images are left out. In scenes with more than 100 000 triangles, the `extras`
/// of each primitive have `coarse`, an accessor of the indices of far fewer triangles with the same vertices. The
/// `extras` of the primitives of a deforming object have `vertices`, an accessor of the mesh's vertex for each of
/// theirs. The scene must be loaded with SceneLook::coded.
Glb make_glb(const Scene& scene, const Workers& workers);

/// The maximum number of triangles for a browser.
inline constexpr std::size_t kMaxTriangles = std::size_t{4} << 20;

}  // namespace esim::studio
