#include "esim/backends/splats/splat_scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <utility>

namespace esim::inline backends::inline splats {
namespace {

constexpr std::size_t kAlignment = 8;  // of clusters
constexpr float kSmallest = 1e-7F;     // standard deviation that is distinguished, m

/// Spreads the lowest 20 bits of x to every third bit.
std::uint64_t spread(std::uint64_t x) {
  x &= 0xfffff;
  x = (x | x << 32) & 0x001f00000000ffff;
  x = (x | x << 16) & 0x001f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  return (x | x << 2) & 0x1249249249249249;
}

/// The order of splats in memory: by size, and in Z-order (Morton) among those of similar size.
std::vector<std::uint32_t> memory_order(const Splats& splats) {
  Eigen::Vector3f low = splats.positions[0], high = low;
  for (const Eigen::Vector3f& p : splats.positions) low = low.cwiseMin(p), high = high.cwiseMax(p);
  const Eigen::Vector3f scale = (high - low).cwiseMax(1e-30F).cwiseInverse() * 1048575.0F;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys(splats.size());
  for (std::size_t i = 0; i < splats.size(); ++i) {
    const Eigen::Vector3f cell = (splats.positions[i] - low).cwiseProduct(scale);
    const auto at = [&](int axis) { return spread(static_cast<std::uint64_t>(cell[axis])) << axis; };
    const float size = std::max(splats.deviations[i].maxCoeff(), kSmallest) / kSmallest;
    const auto octaves = static_cast<std::uint64_t>(std::clamp(std::log2(size) / 4, 0.0F, 15.0F));
    keys[i] = {octaves << 60 | at(0) | at(1) | at(2), static_cast<std::uint32_t>(i)};
  }
  std::sort(keys.begin(), keys.end());
  std::vector<std::uint32_t> order(keys.size());
  std::transform(keys.begin(), keys.end(), order.begin(), [](const auto& key) { return key.second; });
  return order;
}

}  // namespace

SplatGroup::SplatGroup(const Splats& splats) : degree(splats.degree), filter(splats.filter) {
  if (splats.size() == 0) return;
  const std::vector<std::uint32_t> order = memory_order(splats);
  const std::size_t full = (order.size() + SplatCluster::kMost - 1) / SplatCluster::kMost;
  size = full * SplatCluster::kMost;
  const auto resize = [&](Column& column) { column.resize(size); };
  std::ranges::for_each(centre, resize);
  for (auto& axis : axes) std::ranges::for_each(axis, resize);
  std::ranges::for_each(colour, resize);
  resize(opacity);
  harmonics.resize((splats.coefficients() - 1) * 3 * size);

  for (std::size_t first = 0; first < order.size(); first += SplatCluster::kMost) {
    const std::size_t count = std::min(order.size() - first, SplatCluster::kMost);
    const Eigen::Vector3f& start = splats.positions[order[first]];
    SplatCluster cluster{static_cast<std::uint32_t>(first),
                         static_cast<std::uint32_t>((count + kAlignment - 1) / kAlignment * kAlignment), start, start,
                         0};
    for (std::size_t i = first; i < first + cluster.count; ++i) {
      const std::size_t from = order[std::min(i, first + count - 1)];
      const Eigen::Vector3f& p = splats.positions[from];
      const Eigen::Vector3f& deviations = splats.deviations[from];
      const Eigen::Vector4f& q = splats.rotations[from];
      const Eigen::Matrix3f R = Eigen::Quaternionf(q[3], q[0], q[1], q[2]).normalized().toRotationMatrix();
      cluster.low = cluster.low.cwiseMin(p), cluster.high = cluster.high.cwiseMax(p);
      cluster.deviation = std::max(cluster.deviation, deviations.maxCoeff());
      opacity[i] = i < first + count ? splats.opacities[from] : 0;
      for (int k = 0; k < 3; ++k) {
        const auto c = static_cast<std::size_t>(k);
        centre[c][i] = p[k];
        for (int axis = 0; axis < 3; ++axis) axes[static_cast<std::size_t>(axis)][c][i] = R(k, axis) * deviations[axis];
        colour[c][i] = 0.5F + 0.28209479177387814F * splats.harmonics[from * splats.coefficients() * 3 + c];
        for (std::size_t k1 = 1; k1 < splats.coefficients(); ++k1) {
          const float value = splats.harmonics[(from * splats.coefficients() + k1) * 3 + c];
          harmonics[((k1 - 1) * 3 + c) * size + i] =
              std::bit_cast<std::uint16_t>(Eigen::half(std::clamp(value, -65504.0F, 65504.0F)));
        }
      }
    }
    clusters.push_back(cluster);
  }
}

SplatScene::SplatScene(const std::vector<SplatObject>& objects) {
  for (const SplatObject& object : objects) {
    light = object.splats->light;
    groups.push_back({SplatGroup(*object.splats), object.moving ? *object.moving + 1 : 0, object.splats->to_object});
  }
}

std::shared_ptr<const SplatScene> build_splat_scene(const std::vector<SplatObject>& objects) {
  return std::make_shared<const SplatScene>(objects);
}

}  // namespace esim::inline backends::inline splats
