#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "esim/core/colour/colour.h"
#include "esim/scene/environment/octahedral_map.h"
#include "esim/scene/images/texture.h"
#include "esim/scene/planes.h"

namespace esim::inline scene {

/// Light from infinity, in luminance and, if it was made of colours, in each of them. It is kept as octahedral maps,
/// prefiltered for surfaces: one for diffuse surfaces, and a chain of them for the lobes of roughness 0, 1/8, ... 1.
/// Values between texels and between roughnesses are interpolated linearly. The computation is the same in every run.
class Environment {
 public:
  /// `planes`: an equirectangular image in linear light (one plane of luminance, or three of R, G and B), z up, the
  /// centre of the image along +x and its left quarter along +y, as in renderer type panorama. Radiance is `strength`
  /// times the image, which is turned around z by `rotation_rad`, counterclockwise seen from above. Throws UserError
  /// with the prefix `name` if a value is negative or not finite.
  Environment(const Planes& planes, float strength, double rotation_rad, const std::string& name);

  /// Of 0 for luminance, 1 + colour otherwise. Without colours, all are the luminance.
  std::size_t view_offset(std::size_t view) const { return view < view_count_ ? view * view_size_ : 0; }

  /// Mean radiance that a diffuse surface with this normal receives, weighted by the cosine. Directions are in the
  /// world frame, of any length except zero.
  float diffuse(std::size_t view, float x, float y, float z) const {
    return kDiffuse.value(values_.data() + view_offset(view), OctahedralPlace::of(x, y, z));
  }

  /// Mean radiance in the lobe of a roughness (0 to 1) around a direction of reflection, seen along it.
  float specular(std::size_t view, float x, float y, float z, float roughness) const {
    const OctahedralPlace place = OctahedralPlace::of(x, y, z);
    const float level = roughness * (kLevels - 1);
    const auto finer = static_cast<std::size_t>(level < kLevels - 2 ? level : kLevels - 2);
    const float* const values = values_.data() + view_offset(view);
    const float a = levels_[finer].value(values, place), b = levels_[finer + 1].value(values, place);
    return a + (level - static_cast<float>(finer)) * (b - a);
  }

  /// The image with `strength`, without rotation: null for colours that it does not have.
  const std::shared_ptr<const Texture>& sky(std::size_t view) const { return skies_[view < view_count_ ? view : 0]; }
  double rotation_rad() const { return rotation_rad_; }

  static constexpr int kLevels = 9;
  std::span<const OctahedralLayout> levels() const { return levels_; }
  const OctahedralLayout& diffuse_map() const { return kDiffuse; }
  std::span<const float> values() const { return {values_.data(), view_size_}; }  ///< of all maps, in luminance

 private:
  static constexpr OctahedralLayout kDiffuse{64, 0};

  void prefilter(std::span<const Image<float>> views);

  double rotation_rad_;
  std::array<OctahedralLayout, kLevels> levels_;
  std::size_t view_count_ = 0, view_size_ = 0;
  std::vector<float> values_;
  std::array<std::shared_ptr<const Texture>, 4> skies_;  // luminance, red, green, blue
};

/// Reads an equirectangular image in linear light: its planes for an Environment. Throws UserError, naming the file, if
/// it cannot be read or is not twice as wide as high.
Planes load_environment_image(const std::filesystem::path& file, bool colour);

/// Reads an environment. Throws UserError as above.
std::shared_ptr<const Environment> load_environment(const std::filesystem::path& file, float strength,
                                                    double rotation_rad, bool colour);

}  // namespace esim::inline scene
