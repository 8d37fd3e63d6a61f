#pragma once

#include "esim/geometry/se3.h"
#include "esim/scene/scene.h"

namespace esim::studio {

/// T_world_camera of a view that shows what stands still in a scene, or all where nothing does. Where walls are around
/// the middle of a wide floor: from the height of a person's eyes above it, along the longest free line through its
/// middle. Otherwise from outside, obliquely from above, so far that a camera of 65 degrees sees all of it. World z is
/// up. At the origin, along x, where there are no meshes.
SE3 first_view(const Scene& scene);

}  // namespace esim::studio
