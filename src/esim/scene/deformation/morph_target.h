#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace esim::inline scene {

/// A shape that is added to a mesh by a weight: offsets of those vertices that differ.
struct MorphTarget {
  std::vector<std::uint32_t> vertices;     ///< indices, increasing
  std::vector<Eigen::Vector3f> positions;  ///< m, per entry of `vertices`
  std::vector<Eigen::Vector3f> normals;    ///< the same; empty: normals do not change
};

}  // namespace esim::inline scene
