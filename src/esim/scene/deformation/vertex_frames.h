#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace esim::inline scene {

/// The vertices of a mesh at some times.
struct VertexFrames {
  std::vector<double> times_s;             ///< of the frames, increasing; at least one
  std::vector<Eigen::Vector3f> positions;  ///< m; those of the first frame, then those of the second one, ...

  std::size_t vertices_per_frame() const { return positions.size() / times_s.size(); }
};

}  // namespace esim::inline scene
