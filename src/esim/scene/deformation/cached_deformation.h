#pragma once

#include <cstdint>
#include <vector>

#include "esim/scene/deformation/deformation.h"
#include "esim/scene/deformation/shading_normals.h"
#include "esim/scene/deformation/vertex_spline.h"

namespace esim::inline scene {

/// A mesh whose vertices follow those of a file, along splines in time. Velocities are the derivative of the positions.
/// Both have single precision.
class CachedDeformation final : public Deformation {
 public:
  /// `numbers`: for each vertex of the mesh, the vertex of the spline that it follows; these must be valid.
  CachedDeformation(VertexSpline spline, std::vector<std::uint32_t> numbers, ShadingNormals normals);

  TimeSpan span() const override;
  void evaluate(TimeNs t, DeformedVertices& vertices) const override;

  /// The box of the control points at `t`, between which all vertices lie.
  Eigen::AlignedBox3f bounds(TimeNs t) const override;

 private:
  VertexSpline spline_;
  std::vector<std::uint32_t> numbers_;
  ShadingNormals normals_;
  std::vector<Eigen::AlignedBox3f> boxes_;  // per control point, of the vertices in `numbers_`
};

}  // namespace esim::inline scene
