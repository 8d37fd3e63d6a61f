#include "esim/backends/splats/splat_clusters.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>

namespace esim::inline backends::inline splats {
namespace {

constexpr float kSmallest = 1e-7F;  // standard deviation that is distinguished, m

/// Octaves between classes of size: a large splat would make a cluster of small ones visible everywhere.
constexpr float kOctaves = 2;

int size_class(const Splats& splats, std::uint32_t i) {
  const float size = std::max(splats.deviations[i].maxCoeff(), kSmallest) / kSmallest;
  return static_cast<int>(std::log2(size) / kOctaves);
}

/// Sorts splats so that runs of `length` are neighbours, by halving along the longest side of their box, and calls
/// take(run) for each.
void divide(const Splats& splats, std::span<std::uint32_t> order, std::size_t length,
            const std::function<void(std::span<std::uint32_t>)>& take) {
  if (order.size() <= length) return take(order);
  Eigen::AlignedBox3f box;
  for (const std::uint32_t i : order) box.extend(splats.positions[i]);
  int axis = 0;
  box.sizes().maxCoeff(&axis);
  const std::size_t runs = (order.size() + length - 1) / length, middle = runs / 2 * length;  // only the last is short
  std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(middle), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) {
                     const auto place = [&](std::uint32_t i) {
                       const float x = splats.positions[i][axis];
                       return std::isnan(x) ? std::pair(0.0F, i) : std::pair(x, i);
                     };
                     return place(a) < place(b);
                   });
  divide(splats, order.first(middle), length, take);
  divide(splats, order.subspan(middle), length, take);
}

/// The area of a splat's outline, up to a factor, seen from the side where it is largest.
double area_of(const Eigen::Vector3d& deviations) {
  return std::max({deviations.x() * deviations.y(), deviations.y() * deviations.z(), deviations.z() * deviations.x()});
}

/// Adds the splat that replaces `run`.
void add_merged(const Splats& splats, std::span<const std::uint32_t> run, Splats& merged) {
  double total = 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  std::vector<double> harmonics(splats.coefficients() * 3);
  std::array<double, SplatClusters::kMerged> weights{};
  for (std::size_t k = 0; k < run.size(); ++k) {
    const std::uint32_t i = run[k];
    weights[k] = double{splats.opacities[i]} * area_of(splats.deviations[i].cast<double>()) + 1e-30;
    total += weights[k];
    mean += weights[k] * splats.positions[i].cast<double>();
    for (std::size_t h = 0; h < harmonics.size(); ++h)
      harmonics[h] += weights[k] * double{splats.harmonics[i * harmonics.size() + h]};
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
  merged.positions.push_back(mean.cast<float>());
  merged.deviations.push_back(deviations.cast<float>());
  merged.rotations.push_back(Eigen::Quaterniond(R).coeffs().cast<float>());
  merged.opacities.push_back(static_cast<float>(std::min(0.99, total / std::max(area_of(deviations), 1e-30))));
  for (const double value : harmonics) merged.harmonics.push_back(static_cast<float>(value / total));
}

}  // namespace

SplatClusters find_clusters(const Splats& splats) {
  SplatClusters clusters;
  clusters.order.resize(splats.size());
  std::iota(clusters.order.begin(), clusters.order.end(), 0U);
  std::vector<int> classes(splats.size());
  for (const std::uint32_t i : clusters.order) classes[i] = size_class(splats, i);
  std::ranges::stable_sort(clusters.order, std::less(), [&](std::uint32_t i) { return classes[i]; });
  for (auto begin = clusters.order.begin(); begin != clusters.order.end();) {
    const auto end =
        std::find_if(begin, clusters.order.end(), [&](std::uint32_t i) { return classes[i] != classes[*begin]; });
    divide(splats, {begin, end}, SplatClusters::kMost, [&](std::span<std::uint32_t> cluster) {
      divide(splats, cluster, SplatClusters::kMerged, [](std::span<std::uint32_t>) {});
      clusters.ends.push_back((clusters.count() == 0 ? 0 : clusters.ends.back()) + cluster.size());
    });
    begin = end;
  }
  return clusters;
}

MergedSplats merge(const Splats& splats, const SplatClusters& clusters) {
  MergedSplats merged;
  merged.splats.degree = splats.degree;
  merged.splats.filter = splats.filter;
  for (std::size_t i = 0; i < clusters.count(); ++i) {
    const std::span<const std::uint32_t> cluster = clusters.cluster(i);
    for (std::size_t first = 0; first < cluster.size(); first += SplatClusters::kMerged) {
      add_merged(splats, cluster.subspan(first, std::min(SplatClusters::kMerged, cluster.size() - first)),
                 merged.splats);
    }
    merged.clusters.ends.push_back(merged.splats.size());
  }
  merged.clusters.order.resize(merged.splats.size());
  std::iota(merged.clusters.order.begin(), merged.clusters.order.end(), 0U);
  return merged;
}

}  // namespace esim::inline backends::inline splats
