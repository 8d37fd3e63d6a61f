#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "esim/scene/deformation/deformation.h"

namespace esim::studio {

/// The shapes of a deforming mesh are sent for these times, between which the page interpolates linearly.
inline constexpr int kShapesPerSecond = 30;

/// The maximum number of bytes of shapes in an answer, and the size of a vertex in them.
inline constexpr std::size_t kMaxShapeBytes = std::size_t{64} << 20, kShapeVertexBytes = 8;

/// The time of a shape, counted from the start of the deformation's clock, ns.
TimeNs time_of_shape(std::int64_t number);

/// The shapes `first` to first + count - 1 for the page, each as 3 f32 (the least corner of the box around its
/// vertices, m), 3 f32 (the size of a step along each axis, m), and for each vertex 3 u16 (steps from the corner) and 2
/// i8 (its normal in octahedral coordinates times 127); little-endian. Positions are within half a step, 1/131070 of
/// the box.
std::string page_shapes(const Deformation& deformation, std::int64_t first, std::size_t count);

/// A direction in octahedral coordinates, -1 to 1 (Meyer et al. 2010): its projection on the octahedron |x| + |y| + |z|
/// = 1, whose lower half is folded outwards. Directions of length 0 become +z.
Eigen::Vector2f octahedral(const Eigen::Vector3f& direction);

}  // namespace esim::studio
