#pragma once

#include <array>
#include <map>
#include <memory>
#include <string>
#include <tuple>

#include "esim/scene/import/scene_graph.h"
#include "esim/scene/import/texture_store.h"
#include "esim/scene/mesh.h"

namespace esim::inline scene {

/// Converts how the materials of a file shine, and reads the textures for it, each once.
class GlossTextures {
 public:
  explicit GlossTextures(TextureStore& store) : store_(store) {}

  /// A factor outside 0 to 1 is clamped, and a texture that cannot be read is left out, both after a warning. With
  /// SceneLook::coded, textures stay encoded.
  std::shared_ptr<const Gloss> convert(const GraphMaterial& source);

 private:
  using Normals = std::array<std::shared_ptr<const Texture>, 3>;

  std::shared_ptr<const Texture> channel(const GraphTexture& slot, std::size_t which, const std::string& material,
                                         const std::string& assumed);
  Normals normals(const GraphTexture& slot, float scale, const std::string& material);

  TextureStore& store_;
  std::map<std::tuple<std::int32_t, Wrap, Wrap, std::size_t>, std::shared_ptr<const Texture>> channels_;
  std::map<std::tuple<std::int32_t, Wrap, Wrap, float>, Normals> normals_;
};

}  // namespace esim::inline scene
