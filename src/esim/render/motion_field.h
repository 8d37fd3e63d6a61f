#pragma once

#include <Eigen/Core>
#include <vector>

#include "esim/render/pixel_rays.h"
#include "esim/render/renderer.h"

namespace esim {

/// Motion of the camera relative to something rigid, in the camera frame; m/s and rad/s.
struct Twist {
  Eigen::Vector3f v, omega;
};

/// The camera's twist relative to what a request's pixels may see: to what stands still, then to each object (v and
/// omega below).
std::vector<Twist> relative_twists(const RenderRequest& request);

/// Image velocity of the scene as the camera and the scene's objects move (paper, Eq. 4, and V_dyn): fills V of the
/// tile's pixels from their Z and from which object they see, and from the twists relative to those.
///
/// A point at depth Z on the bearing b = (x, y, 1) has, in the camera frame C, the position Z b and the velocity Z w
/// with
///     w = -v / Z - omega x b,
/// so the bearing moves by (w_x - x w_z, w_y - y w_z) per second, and the pixel by the camera model's Jacobian times
/// that. On what stands still, v and omega are the camera's twist; with an undistorted unit camera that is the
/// interaction matrix of the paper, and Z = +inf leaves the rotation. On a moving object O they are the camera's twist
/// relative to the object's rigid motion,
///     v = v_C - (v_O - omega_O x p),   omega = omega_C - omega_O,
/// all in the camera frame, p being the position of the object's origin there: the difference to the above is V_dyn.
///
/// Of rows whose number is not a multiple of `every`, V is left as it is.
void motion_field(const PixelRays& rays, const std::vector<Twist>& twists, const Tile& tile, Sample& sample,
                  int every = 1);

}  // namespace esim
