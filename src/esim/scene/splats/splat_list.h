#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "esim/scene/mesh.h"
#include "esim/scene/splats/splats.h"

// Private to scene.
namespace esim::inline scene {

inline constexpr int kMaxSplatDegree = 3;
inline constexpr std::size_t kMaxSplatCoefficients = 16;  // of a colour: (kMaxSplatDegree + 1)²

/// A splat as read from a file.
struct Splat {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();
  Eigen::Vector3f deviation = Eigen::Vector3f::Zero();
  Eigen::Vector4f rotation = Eigen::Vector4f::UnitW();  ///< x y z w, of any length
  float opacity = 0;

  /// Coefficients of red, green and blue, as in Splats::harmonics.
  std::array<float, kMaxSplatCoefficients * 3> harmonics{};
};

/// Collects the splats of a file. Damaged ones are dropped and counted: those with numbers that are not finite, a
/// rotation of zero, a deviation that is negative or above 1e6 m, or an opacity outside 0 to 1.
class SplatList {
 public:
  /// Reserves memory for `count` splats, after check_splat_count().
  SplatList(std::filesystem::path file, int degree, std::uint64_t count, std::uint64_t file_bytes);

  std::size_t coefficients() const { return splats_.coefficients(); }

  void add(const Splat& splat);

  void set_filter(SplatFilter filter) { splats_.filter = filter; }
  void set_light(SplatLight light) { splats_.light = light; }

  /// Warns if splats were dropped. Throws UserError if none are left.
  Splats finish(const WarningHandler& warn);

 private:
  std::filesystem::path file_;
  Splats splats_;
  std::size_t dropped_ = 0;
};

/// The colour 0.5 + Y_0 k of a splat whose colour is the same in all directions, as the coefficient k.
inline float harmonic_of_colour(float colour) { return (colour - 0.5F) / kHarmonic0; }

/// 1 / (1 + exp(-x)); 0 and 1 at the infinities, which exporters write for them.
float sigmoid(float x);

/// Throws UserError if a file of so many bytes cannot hold so many splats, so that damaged files do not cause large
/// allocations: no real file has more than 16 splats per byte.
void check_splat_count(const std::filesystem::path& file, std::uint64_t count, std::uint64_t file_bytes);

/// Throws the UserError "splats FILE: REASON".
[[noreturn]] void fail_splats(const std::filesystem::path& file, const std::string& reason);

/// Throws UserError: the file holds triangles, for which there is another renderer.
[[noreturn]] void fail_triangles(const std::filesystem::path& file);

/// The warning that degrees above kMaxSplatDegree are not read.
void warn_of_degree(const std::filesystem::path& file, int degree, const WarningHandler& warn);

}  // namespace esim::inline scene
