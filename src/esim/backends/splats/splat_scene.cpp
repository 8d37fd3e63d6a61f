#include "esim/backends/splats/splat_scene.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace esim::inline backends::inline splats {
namespace {

constexpr std::size_t kAlignment = 8;  // of clusters

std::size_t aligned(std::size_t count) { return (count + kAlignment - 1) / kAlignment * kAlignment; }

}  // namespace

SplatGroup::SplatGroup(const Splats& splats, const SplatClusters& parts)
    : degree(splats.degree), filter(splats.filter) {
  for (std::size_t i = 0; i < parts.count(); ++i) size += aligned(parts.cluster(i).size());
  for (auto* columns : {&centre, &axes[0], &axes[1], &axes[2], &colour}) {
    for (Column& column : *columns) column.resize(size);
  }
  opacity.resize(size);
  harmonics.resize((splats.coefficients() - 1) * 3 * size);
  std::size_t next = 0;
  for (std::size_t part = 0; part < parts.count(); ++part) {
    const std::span<const std::uint32_t> cluster = parts.cluster(part);
    const std::size_t count = aligned(cluster.size());
    clusters.push_back({static_cast<std::uint32_t>(next), static_cast<std::uint32_t>(count)});
    Eigen::AlignedBox3f box;
    float largest = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t from = cluster[std::min(i, cluster.size() - 1)];
      set(next + i, splats, from, i < cluster.size() ? splats.opacities[from] : 0);
      box.extend(splats.positions[from]);
      largest = std::max(largest, splats.deviations[from].maxCoeff());
    }
    next += count;
    const Eigen::Vector3f middle = box.center();
    const Eigen::Vector3f half = (box.max() - middle).cwiseMax(middle - box.min());
    for (int k = 0; k < 3; ++k) {
      box_middle[static_cast<std::size_t>(k)].push_back(middle[k]);
      box_half[static_cast<std::size_t>(k)].push_back(half[k]);
    }
    largest_deviation.push_back(largest);
  }
}

/// Sets entry `at` to the splat `from`.
void SplatGroup::set(std::size_t at, const Splats& splats, std::size_t from, float its_opacity) {
  const Eigen::Vector4f& q = splats.rotations[from];
  const Eigen::Matrix3f R = Eigen::Quaternionf(q[3], q[0], q[1], q[2]).normalized().toRotationMatrix();
  const float* const coefficients = &splats.harmonics[from * splats.coefficients() * 3];
  opacity[at] = its_opacity;
  for (int k = 0; k < 3; ++k) {
    const auto c = static_cast<std::size_t>(k);
    centre[c][at] = splats.positions[from][k];
    for (int axis = 0; axis < 3; ++axis)
      axes[static_cast<std::size_t>(axis)][c][at] = R(k, axis) * splats.deviations[from][axis];
    colour[c][at] = 0.5F + 0.28209479177387814F * coefficients[c];
    for (std::size_t h = 1; h < splats.coefficients(); ++h) {
      const float value = std::clamp(coefficients[h * 3 + c], -65504.0F, 65504.0F);
      harmonics[((h - 1) * 3 + c) * size + at] = std::bit_cast<std::uint16_t>(Eigen::half(value));
    }
  }
}

SplatScene::SplatScene(const std::vector<SplatObject>& objects) {
  for (const SplatObject& object : objects) {
    const Splats& splats = *object.splats;
    light = splats.light;
    Placed& placed = groups.emplace_back();
    placed.object = object.moving ? *object.moving + 1 : 0;
    placed.to_object = splats.to_object;
    const SplatClusters clusters = find_clusters(splats);
    placed.fine = SplatGroup(splats, clusters);
    const MergedSplats merged = merge(splats, clusters);
    placed.merged = SplatGroup(merged.splats, merged.clusters);
  }
}

std::shared_ptr<const SplatScene> build_splat_scene(const std::vector<SplatObject>& objects) {
  return std::make_shared<const SplatScene>(objects);
}

}  // namespace esim::inline backends::inline splats
