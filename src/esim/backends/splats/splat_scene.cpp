#include "esim/backends/splats/splat_scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <numeric>
#include <span>

namespace esim::inline backends::inline splats {
namespace {

constexpr std::size_t kAlignment = 8;  // of clusters
constexpr float kSmallest = 1e-7F;     // standard deviation that is distinguished, m

/// Octaves between classes of size: large splats would make a cluster of small ones visible everywhere.
constexpr float kOctaves = 2;

int size_class(const Splats& splats, std::uint32_t i) {
  const float size = std::max(splats.deviations[i].maxCoeff(), kSmallest) / kSmallest;
  return static_cast<int>(std::log2(size) / kOctaves);
}

/// Divides splats in halves along the longest side of their box until clusters are small enough.
void divide(const Splats& splats, std::span<std::uint32_t> order, std::vector<std::span<std::uint32_t>>& clusters) {
  if (order.size() <= SplatCluster::kMost) return clusters.push_back(order);
  Eigen::AlignedBox3f box;
  for (const std::uint32_t i : order) box.extend(splats.positions[i]);
  int axis = 0;
  box.sizes().maxCoeff(&axis);
  // Whole clusters, except for the last one
  const std::size_t whole = (order.size() + SplatCluster::kMost - 1) / SplatCluster::kMost;
  const std::size_t middle = whole / 2 * SplatCluster::kMost;
  std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(middle), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) {
                     const float x = splats.positions[a][axis], y = splats.positions[b][axis];
                     return x < y || (x == y && a < b);
                   });
  divide(splats, order.first(middle), clusters);
  divide(splats, order.subspan(middle), clusters);
}

}  // namespace

SplatGroup::SplatGroup(const Splats& splats) : degree(splats.degree), filter(splats.filter) {
  if (splats.size() == 0) return;
  std::vector<std::uint32_t> order(splats.size());
  std::iota(order.begin(), order.end(), 0U);
  std::vector<int> classes(splats.size());
  for (const std::uint32_t i : order) classes[i] = size_class(splats, i);
  std::ranges::stable_sort(order, std::less(), [&](std::uint32_t i) { return classes[i]; });
  std::vector<std::span<std::uint32_t>> parts;
  for (auto begin = order.begin(); begin != order.end();) {
    const auto end = std::find_if(begin, order.end(), [&](std::uint32_t i) { return classes[i] != classes[*begin]; });
    divide(splats, {begin, end}, parts);
    begin = end;
  }
  size = parts.size() * SplatCluster::kMost;
  const auto resize = [&](Column& column) { column.resize(size); };
  std::ranges::for_each(centre, resize);
  for (auto& axis : axes) std::ranges::for_each(axis, resize);
  std::ranges::for_each(colour, resize);
  resize(opacity);
  harmonics.resize((splats.coefficients() - 1) * 3 * size);

  for (const std::span<std::uint32_t> part : parts) {
    const std::size_t first = clusters.size() * SplatCluster::kMost, count = part.size();
    const SplatCluster cluster{static_cast<std::uint32_t>(first),
                               static_cast<std::uint32_t>((count + kAlignment - 1) / kAlignment * kAlignment)};
    Eigen::AlignedBox3f box;
    float largest = 0;
    for (std::size_t i = first; i < first + cluster.count; ++i) {
      const std::size_t from = part[std::min(i - first, count - 1)];
      const Eigen::Vector3f& p = splats.positions[from];
      const Eigen::Vector3f& deviations = splats.deviations[from];
      const Eigen::Vector4f& q = splats.rotations[from];
      const Eigen::Matrix3f R = Eigen::Quaternionf(q[3], q[0], q[1], q[2]).normalized().toRotationMatrix();
      box.extend(p);
      largest = std::max(largest, deviations.maxCoeff());
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
    const Eigen::Vector3f middle = box.center();
    const Eigen::Vector3f half = (box.max() - middle).cwiseMax(middle - box.min());
    for (int k = 0; k < 3; ++k) {
      box_middle[static_cast<std::size_t>(k)].push_back(middle[k]);
      box_half[static_cast<std::size_t>(k)].push_back(half[k]);
    }
    largest_deviation.push_back(largest);
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
