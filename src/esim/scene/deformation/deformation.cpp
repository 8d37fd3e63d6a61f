#include "esim/scene/deformation/deformation.h"

namespace esim::inline scene {

Eigen::AlignedBox3f Deformation::bounds(TimeNs t) const {
  DeformedVertices vertices;
  evaluate(t, vertices);
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& vertex : vertices.positions) box.extend(vertex);
  return box;
}

}  // namespace esim::inline scene
