#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "esim/scene/splats/splats.h"

// Private to backends/splats.
namespace esim::inline backends::inline splats {

/// Clusters of neighbouring splats of similar size: `order` lists the splats, and cluster i ends before ends[i]. Runs
/// of kMerged splats in a cluster are neighbours, too.
struct SplatClusters {
  static constexpr std::size_t kMost = 128, kMerged = 8;

  std::vector<std::uint32_t> order;
  std::vector<std::size_t> ends;

  std::size_t count() const { return ends.size(); }
  std::span<const std::uint32_t> cluster(std::size_t i) const {
    const std::size_t begin = i == 0 ? 0 : ends[i - 1];
    return std::span(order).subspan(begin, ends[i] - begin);
  }
};

SplatClusters find_clusters(const Splats& splats);

struct MergedSplats {
  Splats splats;
  SplatClusters clusters;  ///< one for each of the original ones
};

/// Replaces each run by one splat with the same mean and covariance; its opacity times its area is the sum of theirs.
MergedSplats merge(const Splats& splats, const SplatClusters& clusters);

}  // namespace esim::inline backends::inline splats
