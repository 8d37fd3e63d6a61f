#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "esim/scene/mesh.h"

namespace esim::inline scene {

/// The normals of a mesh whose vertices move. Vertices with the same position and the same normal in the mesh share
/// one: the mean of the normals of their triangles, weighted by the angles at these vertices (Thürmer and Wüthrich,
/// "Computing Vertex Normals from Polygonal Facets", 1998). So smooth surfaces stay smooth, edges stay sharp, and flat
/// triangles stay flat.
class ShadingNormals {
 public:
  explicit ShadingNormals(const Mesh& mesh);

  /// Computes normals of length 1, or 0 for vertices whose normal in the mesh is 0, or whose triangles are all
  /// degenerate: their area is at most 1e-6 of the square of their longest edge. They point to the side of their
  /// surface to which those of the mesh point. Empty if the mesh has no normals.
  void evaluate(const std::vector<Eigen::Vector3f>& positions, std::vector<Eigen::Vector3f>& normals) const;

 private:
  std::vector<std::array<std::uint32_t, 3>> triangles_;  // indices of vertices
  std::vector<std::uint32_t> group_of_;                  // per vertex
  std::vector<float> sides_;                             // per group: 1, -1, or 0 without a normal
};

}  // namespace esim::inline scene
