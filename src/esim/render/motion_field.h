#pragma once

#include "esim/motion/trajectory.h"
#include "esim/render/pixel_rays.h"
#include "esim/render/sample.h"

namespace esim {

/// Image velocity of a static scene as the camera moves (paper, Eq. 4): fills V of the tile's pixels from their Z.
///
/// A point at depth Z on the bearing b = (x, y, 1) has, in the camera frame, the velocity Z w with
///     w = -v_C / Z - omega_C x b,
/// so the bearing moves by (w_x - x w_z, w_y - y w_z) per second, and the pixel by the camera model's Jacobian times
/// that. With an undistorted unit camera this is the interaction matrix of the paper. Z = +inf leaves the rotation.
void motion_field(const PixelRays& rays, const Kinematics& camera, const Tile& tile, Sample& sample);

}  // namespace esim
