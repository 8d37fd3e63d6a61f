#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>

#include "esim/core/time.h"
#include "esim/render/surface_point.h"

namespace esim::inline render {

/// How the surfaces of a scene's deforming objects move. Any number of threads may ask.
class DeformingSurfaces {
 public:
  virtual ~DeformingSurfaces() = default;

  /// The number of triangles of a moving object that deforms, and 0 if it is rigid; `object` as in Sample::object.
  virtual std::size_t triangle_count(std::size_t object) const = 0;

  /// The positions of points of a deforming object at a time, in the object's frame, m. As many positions as points.
  virtual void locate(std::size_t object, TimeNs t, std::span<const SurfacePoint> points,
                      std::span<Eigen::Vector3f> positions) const = 0;
};

}  // namespace esim::inline render
