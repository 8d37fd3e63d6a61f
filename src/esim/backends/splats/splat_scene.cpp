#include "esim/backends/splats/splat_scene.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace esim::inline backends::inline splats {
namespace {

constexpr std::size_t kAlignment = 8;  // of clusters

std::size_t aligned(std::size_t count) { return (count + kAlignment - 1) / kAlignment * kAlignment; }

}  // namespace

SplatGroup::SplatGroup(const Splats& splats, const SplatClusters& parts, const Workers& workers)
    : clusters(parts.count()), largest_deviation(parts.count()), degree(splats.degree), filter(splats.filter) {
  for (std::size_t i = 0; i < clusters.size(); ++i) {
    const std::size_t count = aligned(parts.cluster(i).size());
    clusters[i] = {static_cast<std::uint32_t>(size), static_cast<std::uint32_t>(count)};
    size += count;
  }
  for (auto* columns : {&box_middle, &box_half}) {
    for (Column& column : *columns) column.resize(clusters.size());
  }
  for (auto* columns : {&centre, &axes[0], &axes[1], &axes[2], &colour}) {
    for (Column& column : *columns) column.resize(size);
  }
  opacity.resize(size);
  harmonics.resize((splats.coefficients() - 1) * 3 * size);
  workers.for_each(static_cast<int>(clusters.size()), [&](int i) {
    fill(static_cast<std::size_t>(i), splats, parts.cluster(static_cast<std::size_t>(i)));
  });
}

void SplatGroup::fill(std::size_t cluster, const Splats& splats, std::span<const std::uint32_t> part) {
  const auto [first, count] = clusters[cluster];
  const auto source = [&](std::size_t i) { return std::size_t{part[std::min(i, part.size() - 1)]}; };
  Eigen::AlignedBox3f box;
  float largest = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t from = source(i), at = first + i;
    const Eigen::Vector4f& q = splats.rotations[from];
    const Eigen::Matrix3f R = Eigen::Quaternionf(q[3], q[0], q[1], q[2]).normalized().toRotationMatrix();
    opacity[at] = i < part.size() ? splats.opacities[from] : 0;
    for (int k = 0; k < 3; ++k) {
      const auto c = static_cast<std::size_t>(k);
      centre[c][at] = splats.positions[from][k];
      for (int axis = 0; axis < 3; ++axis)
        axes[static_cast<std::size_t>(axis)][c][at] = R(k, axis) * splats.deviations[from][axis];
    }
    box.extend(splats.positions[from]);
    largest = std::max(largest, splats.deviations[from].maxCoeff());
  }
  const std::size_t stride = splats.coefficients() * 3;
  for (std::size_t k = 0; k < stride; ++k) {
    for (std::size_t i = 0; i < count; ++i) {
      const float value = splats.harmonics[source(i) * stride + k];
      if (k < 3) {
        colour[k][first + i] = 0.5F + kHarmonic0 * value;
      } else {
        harmonics[(k - 3) * size + first + i] =
            std::bit_cast<std::uint16_t>(Eigen::half(std::clamp(value, -65504.0F, 65504.0F)));
      }
    }
  }
  const Eigen::Vector3f middle = box.center();
  const Eigen::Vector3f half = (box.max() - middle).cwiseMax(middle - box.min());
  for (std::size_t k = 0; k < 3; ++k) {
    box_middle[k][cluster] = middle[static_cast<int>(k)];
    box_half[k][cluster] = half[static_cast<int>(k)];
  }
  largest_deviation[cluster] = largest;
}

SplatScene::SplatScene(const std::vector<SplatObject>& objects) {
  const Workers workers(0);
  for (const SplatObject& object : objects) {
    const Splats& splats = *object.splats;
    light = splats.light;
    Placed& placed = groups.emplace_back();
    placed.object = object.moving ? *object.moving + 1 : 0;
    placed.to_object = splats.to_object;
    const SplatClusters clusters = find_clusters(splats);
    placed.fine = SplatGroup(splats, clusters, workers);
    const MergedSplats merged = merge(splats, clusters, workers);
    placed.merged = SplatGroup(merged.splats, merged.clusters, workers);
  }
}

std::shared_ptr<const SplatScene> build_splat_scene(const std::vector<SplatObject>& objects) {
  return std::make_shared<const SplatScene>(objects);
}

}  // namespace esim::inline backends::inline splats
