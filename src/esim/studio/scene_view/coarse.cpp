#include "esim/studio/scene_view/coarse.h"

#include <meshoptimizer.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace esim::studio {
namespace {

constexpr int kAcrossTexture =
    32;  // vertices further apart in the texture are not merged, since they may belong to different parts

Eigen::Vector3f position(const Surface& surface, std::size_t vertex) {
  return Eigen::Map<const Eigen::Vector3f>(&surface.positions[3 * vertex]);
}

/// Vertices with the same key are merged. 16 bits per coordinate, 8 per texture coordinate.
std::uint64_t key_of(const Surface& surface, std::size_t vertex, const Eigen::Vector3f& origin, float cells_per_m) {
  const Eigen::Vector3f cell = (position(surface, vertex) - origin) * cells_per_m;
  std::uint64_t key = 0;
  for (const float c : cell) key = key << 16 | (static_cast<std::uint64_t>(c) & 0xffff);
  for (std::size_t k = 0; k < 2; ++k) {
    const float across = std::floor(surface.texture_uv[2 * vertex + k] * kAcrossTexture);
    key =
        key << 8 | (std::abs(across) < 1e9F ? static_cast<std::uint64_t>(static_cast<std::int64_t>(across)) & 0xff : 0);
  }
  return key;
}

/// The triangles that are left if the first vertex of each cell replaces all others.
std::vector<std::uint32_t> merged_triangles(const Surface& surface, const Eigen::AlignedBox3f& box, float cells) {
  const float cells_per_m = cells / std::max(box.sizes().maxCoeff(), 1e-30F);
  std::vector<std::uint64_t> keys(surface.positions.size() / 3);
  for (std::size_t i = 0; i < keys.size(); ++i) keys[i] = key_of(surface, i, box.min(), cells_per_m);
  std::vector<std::uint32_t> indices(surface.indices.size());
  meshopt_generateShadowIndexBuffer(indices.data(), surface.indices.data(), indices.size(), keys.data(), keys.size(),
                                    sizeof(std::uint64_t), sizeof(std::uint64_t));
  std::size_t kept = 0;
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    const std::uint32_t a = indices[i], b = indices[i + 1], c = indices[i + 2];
    if (a == b || b == c || c == a) continue;
    indices[kept] = a, indices[kept + 1] = b, indices[kept + 2] = c;
    kept += 3;
  }
  indices.resize(kept);
  return indices;
}

}  // namespace

std::vector<std::uint32_t> coarse_indices(const Surface& surface, std::size_t wanted) {
  if (surface.indices.size() <= 3 * wanted) return {surface.indices.begin(), surface.indices.end()};
  Eigen::AlignedBox3f box;
  for (std::size_t i = 0; i < surface.positions.size() / 3; ++i) box.extend(position(surface, i));

  // A square of n x n cells has 2 n^2 triangles: the initial value of the search for other surfaces.
  constexpr int kTries = 4;
  constexpr float kMaxCells = 32'000;
  float cells = std::sqrt(static_cast<float>(wanted) / 2);
  std::vector<std::uint32_t> best;
  for (int i = 0; i < kTries; ++i) {
    std::vector<std::uint32_t> indices = merged_triangles(surface, box, cells);
    const float ratio = static_cast<float>(wanted) / (static_cast<float>(indices.size() / 3) + 1);
    if (ratio >= 0.9F && indices.size() > best.size()) best = std::move(indices);
    if (ratio >= 0.9F && ratio < 1.5F) break;
    cells = std::clamp(cells * std::sqrt(ratio) * 0.95F, 1.0F, kMaxCells);
  }
  return best;
}

}  // namespace esim::studio
