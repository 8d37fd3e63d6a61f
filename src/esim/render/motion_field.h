#pragma once

#include <Eigen/Core>
#include <vector>

#include "esim/render/pixel_rays.h"
#include "esim/render/renderer.h"

namespace esim::inline render {

/// Motion of the camera relative to a rigid body, in the camera frame; m/s and rad/s.
struct Twist {
  Eigen::Vector3f v, omega;
};

/// The camera's twist (v and omega below) relative to the static scene, then relative to each object.
std::vector<Twist> relative_twists(const RenderRequest& request);

/// Motion field of a moving camera and moving objects (paper, Eq. 4, and V_dyn): fills V of the tile's pixels from
/// their Z, the objects that they see, and the twists relative to these.
///
/// A point at depth Z on the bearing b = (x, y, 1) has, in the camera frame C, the position Z b and the velocity Z w
/// with
///     w = -v / Z - omega x b,
/// so the bearing moves at (w_x - x w_z, w_y - y w_z) per second, and the pixel at the camera model's Jacobian times
/// that. For static points, v and omega are the camera's twist; with an undistorted unit camera this is the
/// interaction matrix of the paper, and for Z = +inf only the rotation remains. For a moving object O they are the
/// camera's twist relative to the object's rigid motion,
///     v = v_C - (v_O - omega_O x p),   omega = omega_C - omega_O,
/// all in the camera frame, where p is the position of the object's origin. The difference between the two is V_dyn.
///
/// Only rows whose number is a multiple of `every` are filled.
void motion_field(const PixelRays& rays, const std::vector<Twist>& twists, const Tile& tile, Sample& sample,
                  int every = 1);

/// Adds to V of a pixel that its surface moves relative to its object at `velocity` (m/s, camera frame): w of
/// motion_field() increases by velocity / Z.
void add_to_motion_field(const PixelRays& rays, int x, int y, const Eigen::Vector3f& velocity, Sample& sample);

}  // namespace esim::inline render
