#pragma once

#include <bit>
#include <cmath>

#include "esim/backends/raycast/packet.h"
#include "esim/backends/raycast/raycast_scene.h"

// Private to backends/raycast.
/// Finds pixels that are crossed by edges of surfaces or of the light on them.
namespace esim::inline backends::inline raycast {

/// The scene as seen by a ray in each of K lanes.
template <int K>
struct SeenSurfaces {
  const Packet<K>& packet;
  const std::array<std::uint32_t, K>& triangles;
  const std::array<float, K>& light;  ///< that the surface receives; undefined if nothing is hit
};

/// A bit for each pixel whose centre and one of whose corners see different surfaces: another object or material, a
/// normal that differs by more than 25 degrees, a distance of more than an eighth of a pixel's width from the centre's
/// plane, or different light. These corners suffice: a straight edge that cuts off a part of a convex pixel separates a
/// corner.
template <int K>
std::uint32_t pixels_on_edges(const SceneTriangles& scene, const RayBlock& block, int first,
                              const SeenSurfaces<K>& centre, const SeenSurfaces<K>& corner) {
  constexpr float kTurned = 0.9F * 0.9F, kApart = 0.125F, kOtherLight = 0.9F;
  const auto &ray0 = centre.packet.ray.ray, &ray1 = corner.packet.ray.ray;
  const auto &hit0 = centre.packet.ray.hit, &hit1 = corner.packet.ray.hit;
  alignas(64) std::array<std::uint32_t, K> on_edge, other_triangle;
#pragma omp simd
  for (int i = 0; i < K; ++i) {
    const float n00 = hit0.Ng_x[i] * hit0.Ng_x[i] + hit0.Ng_y[i] * hit0.Ng_y[i] + hit0.Ng_z[i] * hit0.Ng_z[i];
    const float n11 = hit1.Ng_x[i] * hit1.Ng_x[i] + hit1.Ng_y[i] * hit1.Ng_y[i] + hit1.Ng_z[i] * hit1.Ng_z[i];
    const float n01 = hit0.Ng_x[i] * hit1.Ng_x[i] + hit0.Ng_y[i] * hit1.Ng_y[i] + hit0.Ng_z[i] * hit1.Ng_z[i];
    // From the centre's point to the corner's, both from the same viewpoint, in the frame of the surface.
    const float dx = ray1.tfar[i] * ray1.dir_x[i] - ray0.tfar[i] * ray0.dir_x[i];
    const float dy = ray1.tfar[i] * ray1.dir_y[i] - ray0.tfar[i] * ray0.dir_y[i];
    const float dz = ray1.tfar[i] * ray1.dir_z[i] - ray0.tfar[i] * ray0.dir_z[i];
    const float off = hit0.Ng_x[i] * dx + hit0.Ng_y[i] * dy + hit0.Ng_z[i] * dz;
    const int k = first + i;
    const float area = std::fabs(block.dx_du[k] * block.dy_dv[k] - block.dx_dv[k] * block.dy_du[k]);
    const float max = kApart * ray0.tfar[i];
    const float dark = std::min(centre.light[i], corner.light[i]), bright = std::max(centre.light[i], corner.light[i]);
    other_triangle[i] = centre.triangles[i] ^ corner.triangles[i];
    const bool turned = n01 * std::fabs(n01)<kTurned * n00 * n11, apart = off * off> max * max * area * n00;
    const bool bent = (turned | apart) & (other_triangle[i] != 0);
    const bool lit_otherwise = dark < kOtherLight * bright, other_group = hit0.instID[0][i] != hit1.instID[0][i];
    on_edge[i] = bent | lit_otherwise | other_group ? 1 : 0;
  }
  const std::uint32_t hits0 = centre.packet.hits(), hits1 = corner.packet.hits();
  const std::uint32_t sure = lanes_equal<K>(on_edge.data(), 1) | (hits0 ^ hits1);
  std::uint32_t edges = sure & (hits0 | hits1);
  for (std::uint32_t unsure = hits0 & ~edges & ~lanes_equal<K>(other_triangle.data(), 0); unsure != 0;
       unsure &= unsure - 1) {
    const auto i = static_cast<unsigned>(std::countr_zero(unsure));
    if (scene.material(centre.triangles[i]) != scene.material(corner.triangles[i])) edges |= 1U << i;
  }
  return edges;
}

}  // namespace esim::inline backends::inline raycast
