#pragma once

#include <Eigen/Geometry>
#include <cmath>

namespace esim::inline scene {

/// The frame of a texture on a surface with the unit normal n: t towards larger u, b towards smaller v, both
/// perpendicular to n. From the gradients gu and gv of the texture coordinates in the triangle's plane, whose normal is
/// g. False if these are parallel.
inline bool texture_frame(const Eigen::Vector3f& gu, const Eigen::Vector3f& gv, const Eigen::Vector3f& g,
                          const Eigen::Vector3f& n, Eigen::Vector3f& t, Eigen::Vector3f& b) {
  const float area = gu.dot(gv.cross(g));
  if (!(std::fabs(area) > 0)) return false;
  const Eigen::Vector3f along_u = gv.cross(g) / area, along_v = g.cross(gu) / area;  // derivatives of the point
  t = along_u - along_u.dot(n) * n;
  const float length = t.norm();
  if (!(length > 0) || !std::isfinite(length)) return false;
  t /= length;
  b = n.cross(t);
  if (b.dot(along_v) > 0) b = -b;  // the texture is not mirrored: v points downwards
  return true;
}

}  // namespace esim::inline scene
