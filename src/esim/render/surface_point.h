#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>

namespace esim::inline render {

/// A point of an object: p0 + b1 (p1 - p0) + b2 (p2 - p0) on the triangle with the corners p0, p1, p2.
struct SurfacePoint {
  std::uint32_t triangle = 0;  ///< of the object's mesh
  float b1 = 0, b2 = 0;
};

/// A quantity at a point, from its values at all vertices and the corners of the point's triangle.
inline Eigen::Vector3f at_point(std::span<const Eigen::Vector3f> values, const std::array<std::uint32_t, 3>& corners,
                                const SurfacePoint& point) {
  const Eigen::Vector3f& first = values[corners[0]];
  return first + point.b1 * (values[corners[1]] - first) + point.b2 * (values[corners[2]] - first);
}

}  // namespace esim::inline render
