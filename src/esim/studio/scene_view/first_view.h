#pragma once

#include "esim/geometry/se3.h"
#include "esim/scene/scene.h"

namespace esim::studio {

/// T_world_camera of a view of the static objects of a scene, or of all objects if none is static. If walls surround
/// the middle of a wide floor: at eye height above it, along the longest free line through its middle. Otherwise from
/// outside, obliquely from above, so far away that a camera with a field of view of 65 degrees sees everything. World z
/// is up. Without meshes: at the origin, along x.
SE3 first_view(const Scene& scene);

/// T_world_camera of a view of splats in a box, of which neither floors nor walls are known. If the box is as large as
/// a room: from inside, at eye height, half the way from its middle to its end. Otherwise from outside, as above.
SE3 first_view_of_splats(const Eigen::AlignedBox3d& box);

}  // namespace esim::studio
