#include "esim/backends/splats/splat_clusters.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

namespace esim::inline backends::inline splats {
namespace {

constexpr float kSmallest = 1e-7F, kLargest = 1e6F;  // standard deviations that are distinguished, m

/// Octaves between classes of size: a large splat would make a cluster of small ones visible everywhere.
constexpr float kOctaves = 2;

/// A splat while they are sorted.
struct Item {
  Eigen::Vector3f position;
  std::uint32_t splat;
};

/// Sorts splats so that runs of `length` are neighbours, by halving along the longest side of their box, and calls
/// take(run) for each.
template <typename Take>
void divide(std::span<Item> items, std::size_t length, const Take& take) {
  if (items.size() <= length) return take(items);
  Eigen::AlignedBox3f box;
  for (const Item& item : items) box.extend(item.position);
  int axis = 0;
  box.sizes().maxCoeff(&axis);
  const std::size_t runs = (items.size() + length - 1) / length, middle = runs / 2 * length;  // only the last is short
  std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(middle), items.end(),
                   [&](const Item& a, const Item& b) {
                     const float x = a.position[axis], y = b.position[axis];
                     return x < y || (x == y && a.splat < b.splat);
                   });
  divide(items.first(middle), length, take);
  divide(items.subspan(middle), length, take);
}

/// Sets splat `to` to the one that replaces `run`.
void set_merged(const Splats& splats, std::span<const std::uint32_t> run, std::size_t to, Splats& merged) {
  double total = 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  const auto terms = static_cast<Eigen::Index>(splats.coefficients() * 3);
  Eigen::Array<float, 48, 1> harmonics = Eigen::Array<float, 48, 1>::Zero();
  std::array<double, SplatClusters::kMerged> weights{};
  for (std::size_t k = 0; k < run.size(); ++k) {
    const std::uint32_t i = run[k];
    weights[k] = double{splats.opacities[i]} * largest_area(splats.deviations[i].cast<double>()) + 1e-30;
    total += weights[k];
    mean += weights[k] * splats.positions[i].cast<double>();
    harmonics.head(terms) += static_cast<float>(weights[k]) *
                             Eigen::Map<const Eigen::ArrayXf>(&splats.harmonics[i * splats.coefficients() * 3], terms);
  }
  mean /= total;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (std::size_t k = 0; k < run.size(); ++k) {
    const Eigen::Vector4f& q = splats.rotations[run[k]];
    const Eigen::Matrix3d R = Eigen::Quaternionf(q[3], q[0], q[1], q[2]).cast<double>().normalized().toRotationMatrix();
    const Eigen::Vector3d squares = splats.deviations[run[k]].cast<double>().array().square();
    const Eigen::Vector3d offset = splats.positions[run[k]].cast<double>() - mean;
    covariance += weights[k] / total * (R * squares.asDiagonal() * R.transpose() + offset * offset.transpose());
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(covariance);
  const Eigen::Vector3d deviations = axes.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  Eigen::Matrix3d R = axes.eigenvectors();
  if (R.determinant() < 0) R.col(0) = -R.col(0);
  merged.positions[to] = mean.cast<float>();
  merged.deviations[to] = deviations.cast<float>();
  merged.rotations[to] = Eigen::Quaterniond(R).coeffs().cast<float>();
  merged.opacities[to] = static_cast<float>(std::min(0.99, total / std::max(largest_area(deviations), 1e-30)));
  Eigen::Map<Eigen::ArrayXf>(&merged.harmonics[to * splats.coefficients() * 3], terms) =
      harmonics.head(terms) / static_cast<float>(total);
}

}  // namespace

SplatClusters find_clusters(const Splats& splats) {
  std::vector<std::vector<Item>> classes;  // of size
  for (std::uint32_t i = 0; i < splats.size(); ++i) {
    const float size = std::clamp(splats.deviations[i].maxCoeff(), kSmallest, kLargest) / kSmallest;
    const auto its_class = static_cast<std::size_t>(std::log2(size) / kOctaves);
    if (classes.size() <= its_class) classes.resize(its_class + 1);
    const Eigen::Vector3f& p = splats.positions[i];
    classes[its_class].push_back({p.allFinite() ? p : Eigen::Vector3f::Zero(), i});
  }
  SplatClusters clusters;
  clusters.order.reserve(splats.size());
  for (std::vector<Item>& items : classes) {
    if (items.empty()) continue;
    divide(std::span(items), SplatClusters::kMost, [&](std::span<Item> cluster) {
      divide(cluster, SplatClusters::kMerged, [](std::span<Item>) {});
      for (const Item& item : cluster) clusters.order.push_back(item.splat);
      clusters.ends.push_back(clusters.order.size());
    });
    items = {};
  }
  return clusters;
}

MergedSplats merge(const Splats& splats, const SplatClusters& clusters, const Workers& workers) {
  MergedSplats merged;
  std::size_t count = 0;
  for (std::size_t i = 0; i < clusters.count(); ++i) {
    count += (clusters.cluster(i).size() + SplatClusters::kMerged - 1) / SplatClusters::kMerged;
    merged.clusters.ends.push_back(count);
  }
  merged.clusters.order.resize(count);
  std::iota(merged.clusters.order.begin(), merged.clusters.order.end(), 0U);
  Splats& to = merged.splats;
  to.degree = splats.degree, to.filter = splats.filter;
  to.positions.resize(count), to.deviations.resize(count), to.rotations.resize(count), to.opacities.resize(count);
  to.harmonics.resize(count * to.coefficients() * 3);
  workers.for_each(static_cast<int>(clusters.count()), [&](int i) {
    const std::span<const std::uint32_t> cluster = clusters.cluster(static_cast<std::size_t>(i));
    std::size_t next = merged.clusters.cluster(static_cast<std::size_t>(i)).front();
    for (std::size_t first = 0; first < cluster.size(); first += SplatClusters::kMerged)
      set_merged(splats, cluster.subspan(first, std::min(SplatClusters::kMerged, cluster.size() - first)), next++, to);
  });
  return merged;
}

}  // namespace esim::inline backends::inline splats
