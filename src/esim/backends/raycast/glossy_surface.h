#pragma once

#include <algorithm>
#include <bit>
#include <cmath>

#include "esim/backends/raycast/lights.h"
#include "esim/scene/texture_frame.h"

// Private to backends/raycast.
/// Surfaces that shine, which a packet of rays has hit. All vectors are in the camera frame.
namespace esim::inline backends::inline raycast {

/// Smoother surfaces would mirror a lamp, which is a point, as one of infinite radiance.
inline constexpr float kSmoothest = 0.03F;

/// The parameters of glossy surfaces (see Gloss), averaged over each footprint.
template <int K>
struct GlossLanes {
  alignas(64) std::array<float, K> metallic, roughness, reflectance, edge_reflectance;
  VectorLanes<K> relief;    // mean normals of normal maps, in the frame of the texture
  std::uint32_t rough = 0;  // a bit per lane with a normal map

  /// Looks them up for the lanes in `lanes`, material by material.
  void look_up(const RaycastScene& scene, const std::array<std::uint32_t, K>& materials, const TextureLookup<K>& at,
               std::uint32_t lanes) {
    static const Gloss kMatte;
    rough = 0;
    while (lanes != 0) {
      const std::uint32_t current = materials[static_cast<std::size_t>(std::countr_zero(lanes))];
      const std::uint32_t same = lanes_equal<K>(materials.data(), current) & lanes;
      lanes &= ~same;
      const Gloss* const given = scene.material(current).gloss.get();
      const Gloss& gloss = given != nullptr ? *given : kMatte;
      fill_mean<K>(gloss.metallic_texture.get(), gloss.metallic, at, same, metallic);
      fill_mean<K>(gloss.roughness_texture.get(), gloss.roughness, at, same, roughness);
      fill_mean<K>(nullptr, gloss.reflectance, at, same, reflectance);
      fill_mean<K>(nullptr, gloss.edge_reflectance, at, same, edge_reflectance);
      if (gloss.normal_textures[0] == nullptr) continue;
      rough |= same;
      fill_mean<K>(gloss.normal_textures[0].get(), 1, at, same, relief.x);
      fill_mean<K>(gloss.normal_textures[1].get(), 1, at, same, relief.y);
      fill_mean<K>(gloss.normal_textures[2].get(), 1, at, same, relief.z);
    }
  }
};

/// What of a surface decides how it reflects.
template <int K>
struct GlossySurface {
  SurfacePoints<K> at;                           // with the normals that light sees
  VectorLanes<K> view;                           // unit vectors to the camera
  alignas(64) std::array<float, K> cosine_view;  // between the normal and these, at least kGrazing
  alignas(64) std::array<float, K> roughness;
  alignas(64) std::array<float, K> alpha2;  // square of the lobe's alpha
  GlossLanes<K> gloss;

  static constexpr float kGrazing = 1e-3F;

  void take(const RaycastScene& scene, const SceneTriangles& shapes, const Packet<K>& packet,
            const std::array<std::uint32_t, K>& triangles, const std::array<std::uint32_t, K>& materials,
            const TextureLookup<K>& texture, const GroupRotations<K>& rotations, std::uint32_t lanes) {
    at.take(shapes, packet, triangles, rotations);
    gloss.look_up(scene, materials, texture, lanes);
    alignas(64) std::array<float, K> widening{};
    if (gloss.rough != 0) bend_normals(shapes, packet, triangles, rotations, widening);
#pragma omp simd
    for (int i = 0; i < K; ++i) {
      const float x = at.point.x[i], y = at.point.y[i], z = at.point.z[i];
      const float per_length = -1 / std::sqrt(x * x + y * y + z * z);
      view.x[i] = per_length * x, view.y[i] = per_length * y, view.z[i] = per_length * z;
      const float cosine = at.normal.x[i] * view.x[i] + at.normal.y[i] * view.y[i] + at.normal.z[i] * view.z[i];
      cosine_view[i] = std::min(std::max(kGrazing, cosine), 1.0F);
      const float smooth = std::max(kSmoothest, gloss.roughness[i]), alpha = smooth * smooth;
      alpha2[i] = std::min(alpha * alpha + widening[i], 1.0F);
      roughness[i] = std::sqrt(std::sqrt(alpha2[i]));
    }
  }

 private:
  /// Replaces the normals by those of normal maps. A mean normal of length m means that normals in the footprint vary,
  /// with a variance of their slopes of (1 - m) / m (Toksvig, "Mipmapping normal maps", 2004); alpha² of a lobe is
  /// twice the variance of its slopes, so that this widens it by `widening`.
  void bend_normals(const SceneTriangles& shapes, const Packet<K>& packet,
                    const std::array<std::uint32_t, K>& triangles, const GroupRotations<K>& rotations,
                    std::array<float, K>& widening) {
    const auto& R = rotations.element;
    for (std::uint32_t left = gloss.rough; left != 0; left &= left - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(left));
      TriangleShading memory;
      const TriangleShading& triangle = shapes.triangle(triangles[i], memory);
      const auto rotated = [&](const float* v) {
        return Eigen::Vector3f(R[0][i] * v[0] + R[1][i] * v[1] + R[2][i] * v[2],
                               R[3][i] * v[0] + R[4][i] * v[1] + R[5][i] * v[2],
                               R[6][i] * v[0] + R[7][i] * v[1] + R[8][i] * v[2]);
      };
      const Eigen::Vector3f m(2 * gloss.relief.x[i] - 1, 2 * gloss.relief.y[i] - 1, 2 * gloss.relief.z[i] - 1);
      const float length = std::min(m.norm(), 1.0F);
      Eigen::Vector3f n(at.normal.x[i], at.normal.y[i], at.normal.z[i]), t, b;
      const Eigen::Vector3f g(at.triangle_normal.x[i], at.triangle_normal.y[i], at.triangle_normal.z[i]);
      if (!(length > 1e-3F) || !texture_frame(rotated(triangle.gradient_u), rotated(triangle.gradient_v), g, n, t, b))
        continue;
      // Seen from behind, the relief is the other way around.
      const float across[3] = {packet.ray.hit.Ng_x[i], packet.ray.hit.Ng_y[i], packet.ray.hit.Ng_z[i]};
      const float side = rotated(across).dot(g) > 0 ? 1.0F : -1.0F;
      n = (side * (m.x() * t + m.y() * b) + m.z() * n).normalized();
      at.normal.x[i] = n.x(), at.normal.y[i] = n.y(), at.normal.z[i] = n.z();
      widening[i] = 2 * (1 - length) / length;
    }
  }
};

}  // namespace esim::inline backends::inline raycast
