#include "esim/backends/raycast/raster/screen_triangles.h"

#include <bit>
#include <cmath>
#include <limits>

namespace esim::inline backends::inline raycast {
namespace {

/// 2 to the power that brings a positive number to [1, 2).
inline double to_unit(double value) {
  constexpr std::uint64_t kExponent = 0x7ff0000000000000U, kTwiceOne = 0x7fe0000000000000U;
  return std::bit_cast<double>(kTwiceOne - (std::bit_cast<std::uint64_t>(value) & kExponent));
}

}  // namespace

void ScreenLeaf::project(const TriangleTree::Leaf& leaf, const Eigen::Matrix3f& R, const Eigen::Vector3f& camera) {
  constexpr float kRounding = 2e-6F;
  alignas(64) std::array<std::array<Lanes, 3>, 3> p;  // the corners in the camera frame
  const float cx = camera.x(), cy = camera.y(), cz = camera.z();
  for (std::size_t c = 0; c < 3; ++c) {
#pragma omp simd
    for (std::size_t i = 0; i < kWide; ++i) {
      const float x = leaf.corner[c][0][i] - cx, y = leaf.corner[c][1][i] - cy, z = leaf.corner[c][2][i] - cz;
      p[c][0][i] = R(0, 0) * x + R(0, 1) * y + R(0, 2) * z;
      p[c][1][i] = R(1, 0) * x + R(1, 1) * y + R(1, 2) * z;
      p[c][2][i] = R(2, 0) * x + R(2, 1) * y + R(2, 2) * z;
    }
  }

  // In double precision, products of floats are exact, so that p x q is the opposite of q x p.
  alignas(64) std::array<std::array<std::array<double, kWide>, 3>, 3> n;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto &from = p[(k + 1) % 3], &to = p[(k + 2) % 3];
#pragma omp simd
    for (std::size_t i = 0; i < kWide; ++i) {
      const double fx = from[0][i], fy = from[1][i], fz = from[2][i], tx = to[0][i], ty = to[1][i], tz = to[2][i];
      n[k][0][i] = fy * tz - fz * ty;
      n[k][1][i] = fz * tx - fx * tz;
      n[k][2][i] = fx * ty - fy * tx;
    }
  }

  alignas(64) Lanes usable;
#pragma omp simd
  for (std::size_t i = 0; i < kWide; ++i) {
    const double volume = n[0][0][i] * p[0][0][i] + n[0][1][i] * p[0][1][i] + n[0][2][i] * p[0][2][i];
    const double fx = n[0][0][i] + n[1][0][i] + n[2][0][i], fy = n[0][1][i] + n[1][1][i] + n[2][1][i],
                 fz = n[0][2][i] + n[1][2][i] + n[2][2][i];
    inverse_depth[0][i] = static_cast<float>(fx / volume);
    inverse_depth[1][i] = static_cast<float>(fy / volume);
    inverse_depth[2][i] = static_cast<float>(fz / volume);
    double largest = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      largest = std::max(largest, std::fabs(n[k][0][i]));
      largest = std::max(largest, std::fabs(n[k][1][i]));
      largest = std::max(largest, std::fabs(n[k][2][i]));
    }
    const double scale = volume < 0 ? -to_unit(largest) : to_unit(largest);
    for (std::size_t k = 0; k < 3; ++k) {
      weight[k][0][i] = static_cast<float>(scale * n[k][0][i]);
      weight[k][1][i] = static_cast<float>(scale * n[k][1][i]);
      weight[k][2][i] = static_cast<float>(scale * n[k][2][i]);
    }
    // The sum is finite if all of them are.
    const float sum = std::fabs(inverse_depth[0][i]) + std::fabs(inverse_depth[1][i]) + std::fabs(inverse_depth[2][i]);
    const bool is_finite = sum < kInfinity && largest < std::numeric_limits<double>::max();
    usable[i] = is_finite && volume != 0 ? 1.0F : 0.0F;
  }

#pragma omp simd
  for (std::size_t i = 0; i < kWide; ++i) {
    const float z0 = p[0][2][i], z1 = p[1][2][i], z2 = p[2][2][i];
    const float min_z = std::min(std::min(z0, z1), z2), max_z = std::max(std::max(z0, z1), z2);
    const bool in_front = min_z > kNearestDepth;
    nearest[i] = in_front ? (1 + kRounding) / min_z : kInfinity;
    farthest[i] = (1 - kRounding) / max_z;
    const float x0 = p[0][0][i] / z0, x1 = p[1][0][i] / z1, x2 = p[2][0][i] / z2;
    const float y0 = p[0][1][i] / z0, y1 = p[1][1][i] / z1, y2 = p[2][1][i] / z2;
    const float l = std::min(std::min(x0, x1), x2), r = std::max(std::max(x0, x1), x2);
    const float t = std::min(std::min(y0, y1), y2), b = std::max(std::max(y0, y1), y2);
    left[i] = in_front ? l - kRounding * (1 + std::fabs(l)) : -kInfinity;
    right[i] = in_front ? r + kRounding * (1 + std::fabs(r)) : kInfinity;
    top[i] = in_front ? t - kRounding * (1 + std::fabs(t)) : -kInfinity;
    bottom[i] = in_front ? b + kRounding * (1 + std::fabs(b)) : kInfinity;
    corner_x[0][i] = x0, corner_x[1][i] = x1, corner_x[2][i] = x2;
    corner_y[0][i] = y0, corner_y[1][i] = y1, corner_y[2][i] = y2;
    usable[i] = max_z > kNearestDepth ? usable[i] : 0.0F;

    const float ax = leaf.corner[1][0][i] - leaf.corner[0][0][i], bx = leaf.corner[2][0][i] - leaf.corner[0][0][i];
    const float ay = leaf.corner[1][1][i] - leaf.corner[0][1][i], by = leaf.corner[2][1][i] - leaf.corner[0][1][i];
    const float az = leaf.corner[1][2][i] - leaf.corner[0][2][i], bz = leaf.corner[2][2][i] - leaf.corner[0][2][i];
    normal[0][i] = ay * bz - az * by, normal[1][i] = az * bx - ax * bz, normal[2][i] = ax * by - ay * bx;
  }
  visible = 0;
  for (unsigned i = 0; i < kWide; ++i) visible |= (usable[i] > 0 ? 1U : 0U) << i;
}

ScreenTriangle ScreenLeaf::triangle(std::size_t lane) const {
  ScreenTriangle out{};
  for (std::size_t k = 0; k < 3; ++k)
    out.x[k] = weight[k][0][lane], out.y[k] = weight[k][1][lane], out.one[k] = weight[k][2][lane];
  out.x[3] = inverse_depth[0][lane], out.y[3] = inverse_depth[1][lane], out.one[3] = inverse_depth[2][lane];
  out.farthest = farthest[lane], out.nearest = nearest[lane];
  for (std::size_t k = 0; k < 3; ++k) out.corner_x[k] = corner_x[k][lane], out.corner_y[k] = corner_y[k][lane];
  out.normal = {normal[0][lane], normal[1][lane], normal[2][lane]};
  return out;
}

}  // namespace esim::inline backends::inline raycast
