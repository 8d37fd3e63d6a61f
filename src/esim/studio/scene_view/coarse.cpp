#include "esim/studio/scene_view/coarse.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <unordered_map>

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

/// The vertex that replaces each vertex.
std::vector<std::uint32_t> representatives(const Surface& surface, const Eigen::AlignedBox3f& box, float cells) {
  struct Cell {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    float vertices = 0, distance2 = 0;
    std::uint32_t nearest = 0;
  };
  const std::size_t count = surface.positions.size() / 3;
  const float cells_per_m = cells / std::max(box.sizes().maxCoeff(), 1e-30F);
  std::unordered_map<std::uint64_t, std::uint32_t> known;
  known.reserve(count / 4);
  std::vector<Cell> merged;
  std::vector<std::uint32_t> cell_of(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto next = static_cast<std::uint32_t>(merged.size());
    const auto [entry, is_new] = known.try_emplace(key_of(surface, i, box.min(), cells_per_m), next);
    if (is_new) merged.emplace_back();
    cell_of[i] = entry->second;
    merged[entry->second].sum += position(surface, i) - box.min();
    merged[entry->second].vertices += 1;
  }
  for (std::size_t i = 0; i < count; ++i) {
    Cell& cell = merged[cell_of[i]];
    const float distance2 = (box.min() + cell.sum / cell.vertices - position(surface, i)).squaredNorm();
    if (cell.distance2 > 0 && distance2 >= cell.distance2) continue;
    cell.distance2 = std::max(distance2, 1e-30F), cell.nearest = static_cast<std::uint32_t>(i);
  }
  for (std::uint32_t& cell : cell_of) cell = merged[cell].nearest;
  return cell_of;
}

std::vector<std::uint32_t> merged_triangles(const Surface& surface, const Eigen::AlignedBox3f& box, float cells) {
  const std::vector<std::uint32_t> stands_for = representatives(surface, box, cells);
  std::vector<std::uint32_t> indices;
  for (std::size_t i = 0; i < surface.indices.size(); i += 3) {
    const std::uint32_t a = stands_for[surface.indices[i]], b = stands_for[surface.indices[i + 1]],
                        c = stands_for[surface.indices[i + 2]];
    if (a != b && b != c && c != a) indices.insert(indices.end(), {a, b, c});
  }
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
