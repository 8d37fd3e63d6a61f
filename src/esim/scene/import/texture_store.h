#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <tuple>
#include <vector>

#include "esim/core/colour/colour.h"
#include "esim/scene/import/scene_graph.h"
#include "esim/scene/planes.h"

namespace esim::inline scene {

/// The part of an image or a material that is used.
enum class View { red, green, blue, luminance };

/// Reads the images of a scene, once for each way in which they are used.
class TextureStore {
 public:
  /// Views other than luminance require that `look` has colours.
  TextureStore(const SceneGraph& graph, std::filesystem::path folder, const WarningHandler& warn, SceneLook look)
      : graph_(graph), folder_(std::move(folder)), warn_(warn), look_(look) {}

  SceneLook look() const { return look_; }

  /// A view of an image whose colours are multiplied by `factor`. Null if the slot has no texture, and, after a warning
  /// that names the material, if its image is missing, not allowed or unreadable.
  std::shared_ptr<const Texture> get(const GraphTexture& slot, const Eigen::Vector3f& factor,
                                     const std::string& material, View view);

  /// The encoded image. Null as above; the bytes are not checked. The warning says what is `assumed` without it.
  std::shared_ptr<const CodedTexture> coded(const GraphTexture& slot, const std::string& material,
                                            const std::string& assumed = kGrey);

  /// An image of numbers, not of light: its R, G and B from 0 to 1 as the file has them. Empty if it is missing, not
  /// allowed or unreadable, after a warning that names the material and says what is `assumed` instead.
  Planes numbers(const GraphTexture& slot, const std::string& material, const std::string& assumed);

  const WarningHandler& warning() const { return warn_; }

  /// Number of images that were read.
  std::size_t image_count() const { return image_count_; }

 private:
  static constexpr const char* kGrey = "its surfaces are grey";
  using Views = std::array<std::shared_ptr<const Texture>, 4>;

  Views views_of(const GraphTexture& slot, const Eigen::Vector3f& factor);
  CodedTexture read(const GraphTexture& slot) const;
  void warn_failed(const std::string& material, const UserError& error, const std::string& assumed = kGrey) const;
  void count_texels(const Planes& planes);

  const SceneGraph& graph_;
  std::filesystem::path folder_;
  const WarningHandler& warn_;
  SceneLook look_;
  std::map<std::tuple<std::int32_t, Wrap, Wrap, std::array<float, 3>>, Views> textures_;
  std::map<std::tuple<std::int32_t, Wrap, Wrap>, std::shared_ptr<const CodedTexture>> coded_;
  std::size_t image_count_ = 0, texel_count_ = 0;
};

}  // namespace esim::inline scene
