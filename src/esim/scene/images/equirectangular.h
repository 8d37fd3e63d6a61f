#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "esim/core/fast_arc_tangent.h"
#include "esim/scene/images/texture.h"

namespace esim::inline scene {

/// Arc tangent of y/x on (-pi, pi], within 3e-7.
inline float fast_angle(float y, float x) {
  constexpr float kPi = std::numbers::pi_v<float>;
  const float abs_x = std::fabs(x), abs_y = std::fabs(y);
  float angle = fast_arc_tangent(std::min(abs_x, abs_y) / std::max(std::max(abs_x, abs_y), 1e-30F));
  angle = abs_y > abs_x ? kPi / 2 - angle : angle;
  angle = x < 0 ? kPi - angle : angle;
  return std::copysign(angle, y);
}

/// Where K pixels see an equirectangular image whose z axis points up and whose centre is at +x. `rays` has arrays of
/// K: the bearing (x, y, 1) in the camera frame, and its derivatives dx_du, dx_dv, dy_du, dy_dv by the pixel.
template <int K, class Rays>
TextureLookup<K> on_equirectangular(const Eigen::Matrix3f& R_image_camera, const Rays& rays) {
  const Eigen::Matrix3f& R = R_image_camera;
  TextureLookup<K> at;
  const float r00 = R(0, 0), r01 = R(0, 1), r02 = R(0, 2);
  const float r10 = R(1, 0), r11 = R(1, 1), r12 = R(1, 2);
  const float r20 = R(2, 0), r21 = R(2, 1), r22 = R(2, 2);
  constexpr float kPi = std::numbers::pi_v<float>, kPerLongitude = -1 / (2 * kPi), kPerLatitude = -1 / kPi;
#pragma omp simd
  for (int i = 0; i < K; ++i) {
    const float bx = rays.x[i], by = rays.y[i];
    const float dx = r00 * bx + r01 * by + r02, dy = r10 * bx + r11 * by + r12, dz = r20 * bx + r21 * by + r22;
    const float rho2 = std::max(dx * dx + dy * dy, 1e-12F);
    const float rho = std::sqrt(rho2);
    at.u[i] = 0.5F + kPerLongitude * fast_angle(dy, dx);
    at.v[i] = 0.5F + kPerLatitude * fast_angle(dz, rho);

    // Derivatives of u and v with respect to d, then with respect to the pixel to the right and downwards.
    const float u_x = -kPerLongitude * dy / rho2, u_y = kPerLongitude * dx / rho2;
    const float scale = kPerLatitude / (rho2 + dz * dz);
    const float v_x = -dz * dx / rho * scale, v_y = -dz * dy / rho * scale, v_z = rho * scale;
    const float right_x = r00 * rays.dx_du[i] + r01 * rays.dy_du[i], down_x = r00 * rays.dx_dv[i] + r01 * rays.dy_dv[i];
    const float right_y = r10 * rays.dx_du[i] + r11 * rays.dy_du[i], down_y = r10 * rays.dx_dv[i] + r11 * rays.dy_dv[i];
    const float right_z = r20 * rays.dx_du[i] + r21 * rays.dy_du[i], down_z = r20 * rays.dx_dv[i] + r21 * rays.dy_dv[i];
    at.du_dx[i] = u_x * right_x + u_y * right_y;
    at.dv_dx[i] = v_x * right_x + v_y * right_y + v_z * right_z;
    at.du_dy[i] = u_x * down_x + u_y * down_y;
    at.dv_dy[i] = v_x * down_x + v_y * down_y + v_z * down_z;
  }
  return at;
}

}  // namespace esim::inline scene
