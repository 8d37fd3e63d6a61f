#pragma once

#include "esim/geometry/se3.h"
#include "esim/scene/scene.h"

namespace esim::studio {

/// T_world_camera of a view of the static objects of a scene, or of all objects if none is static. If walls surround
/// the middle of a wide floor: at eye height above it, along the longest free line through its middle. Otherwise from
/// outside, obliquely from above, so far away that a camera with a field of view of 65 degrees sees everything. World z
/// is up. Without meshes: at the origin, along x.
SE3 first_view(const Scene& scene);

}  // namespace esim::studio
