#pragma once

#include <bit>
#include <cmath>

#include "esim/backends/raycast/packet.h"
#include "esim/backends/raycast/raycast_scene.h"

// Private to backends/raycast.
/// Colours of the surfaces that a packet of rays has hit. All vectors are in the camera frame.
namespace esim::inline backends::inline raycast {

/// The rotations to the camera frame from the groups that the lanes have hit, element by element.
template <int K>
class GroupRotations {
 public:
  void select(const Packet<K>& packet, const std::vector<PlacedGroup>& groups) {
    const unsigned first = packet.group(0);
    if (lanes_equal<K>(packet.ray.hit.instID[0], first) == kEveryLane<K>) {
      if (first == selected_) return;
      for (int e = 0; e < 9; ++e) element[e].fill(groups[first].R_camera_group(e / 3, e % 3));
      selected_ = first;
      return;
    }
    for (unsigned i = 0; i < K; ++i) {
      for (int e = 0; e < 9; ++e) element[e][i] = groups[packet.group(i)].R_camera_group(e / 3, e % 3);
    }
    selected_ = kSeveral;
  }

  alignas(64) std::array<float, K> element[9];  // row-major

 private:
  static constexpr unsigned kSeveral = ~0U;
  unsigned selected_ = kSeveral;
};

/// Triangles that the lanes have hit, field by field as in TriangleShading.
template <int K>
struct HitTriangles {
  alignas(64) std::array<float, K> u0, v0, u1, v1, u2, v2;
  alignas(64) std::array<float, K> ux, uy, uz, vx, vy, vz;
  alignas(64) std::array<std::uint32_t, K> material;

  void gather(const SceneTriangles& scene, const std::array<std::uint32_t, K>& indices) {
    thread_local std::array<TriangleShading, K> memory;
    std::array<const TriangleShading*, K> triangles;
    for (unsigned i = 0; i < K; ++i) {
      triangles[i] = &scene.triangle(indices[i], memory[i]);
      material[i] = triangles[i]->material;
    }
    for (unsigned i = 0; i < K; i += 4) {
      transpose(&triangles[i], 0, &u0[i], &v0[i], &u1[i], &v1[i]);
      transpose(&triangles[i], 4, &u2[i], &v2[i], &ux[i], &uy[i]);
      transpose(&triangles[i], 8, &uz[i], &vx[i], &vy[i], &vz[i]);
    }
  }

 private:
  /// Four fields of four triangles, from `field` on.
  static void transpose(const TriangleShading* const* triangles, std::size_t field, float* out0, float* out1,
                        float* out2, float* out3) {
    namespace hn = hwy::HWY_NAMESPACE;
    const hn::Full128<float> d;
    const auto load = [&](int i) { return hn::Load(d, &triangles[i]->u0 + field); };
    const auto a = load(0), b = load(1), c = load(2), e = load(3);
    const auto ac = hn::InterleaveLower(d, a, c), be = hn::InterleaveLower(d, b, e);
    const auto ac_upper = hn::InterleaveUpper(d, a, c), be_upper = hn::InterleaveUpper(d, b, e);
    hn::Store(hn::InterleaveLower(d, ac, be), d, out0);
    hn::Store(hn::InterleaveUpper(d, ac, be), d, out1);
    hn::Store(hn::InterleaveLower(d, ac_upper, be_upper), d, out2);
    hn::Store(hn::InterleaveUpper(d, ac_upper, be_upper), d, out3);
  }
};

/// Texture coordinates and footprints, `footprint` pixels wide. As the bearing b moves by e, the point on a plane of
/// normal n seen along it moves by Z (e - b (n.e)/(n.b)).
template <int K>
void locate_on_textures(const Packet<K>& packet, const RayBlock& block, int first, float footprint,
                        const GroupRotations<K>& rotations, const HitTriangles<K>& on, TextureLookup<K>& at) {
  const auto& R = rotations.element;
  const auto& ray = packet.ray.ray;
  const auto& hit = packet.ray.hit;
#pragma omp simd
  for (int i = 0; i < K; ++i) {
    // Lanes without a hit have undefined values.
    const float depth = ray.tfar[i] < kInfinity ? ray.tfar[i] : 0.0F;
    const float b1 = depth > 0 ? hit.u[i] : 0.0F, b2 = depth > 0 ? hit.v[i] : 0.0F;
    at.u[i] = on.u0[i] + b1 * on.u1[i] + b2 * on.u2[i];
    at.v[i] = on.v0[i] + b1 * on.v1[i] + b2 * on.v2[i];

    // The normal and the gradients of the texture coordinates, rotated to the camera frame.
    const float hx = depth > 0 ? hit.Ng_x[i] : 0.0F, hy = depth > 0 ? hit.Ng_y[i] : 0.0F,
                hz = depth > 0 ? hit.Ng_z[i] : 0.0F;
    const float nx = R[0][i] * hx + R[1][i] * hy + R[2][i] * hz;
    const float ny = R[3][i] * hx + R[4][i] * hy + R[5][i] * hz;
    const float nz = R[6][i] * hx + R[7][i] * hy + R[8][i] * hz;
    const float ux = R[0][i] * on.ux[i] + R[1][i] * on.uy[i] + R[2][i] * on.uz[i];
    const float uy = R[3][i] * on.ux[i] + R[4][i] * on.uy[i] + R[5][i] * on.uz[i];
    const float uz = R[6][i] * on.ux[i] + R[7][i] * on.uy[i] + R[8][i] * on.uz[i];
    const float vx = R[0][i] * on.vx[i] + R[1][i] * on.vy[i] + R[2][i] * on.vz[i];
    const float vy = R[3][i] * on.vx[i] + R[4][i] * on.vy[i] + R[5][i] * on.vz[i];
    const float vz = R[6][i] * on.vx[i] + R[7][i] * on.vy[i] + R[8][i] * on.vz[i];

    // Derivatives by the bearing (1, 0) and (0, 1), then by the pixel to the right and downwards.
    const float bx = packet.bearing_x[i], by = packet.bearing_y[i];
    const float facing = nx * bx + ny * by + nz;
    const float per_facing = std::fabs(facing) > 1e-20F ? 1.0F / facing : 0.0F;
    const float u_b = (ux * bx + uy * by + uz) * per_facing, v_b = (vx * bx + vy * by + vz) * per_facing;
    const float scale = depth * footprint;
    const float u_bx = scale * (ux - u_b * nx), u_by = scale * (uy - u_b * ny);
    const float v_bx = scale * (vx - v_b * nx), v_by = scale * (vy - v_b * ny);
    at.du_dx[i] = u_bx * block.dx_du[first + i] + u_by * block.dy_du[first + i];
    at.dv_dx[i] = v_bx * block.dx_du[first + i] + v_by * block.dy_du[first + i];
    at.du_dy[i] = u_bx * block.dx_dv[first + i] + u_by * block.dy_dv[first + i];
    at.dv_dy[i] = v_bx * block.dx_dv[first + i] + v_by * block.dy_dv[first + i];
  }
}

/// Mean of factor times a texture over each footprint.
template <int K>
void fill_mean(const Texture* texture, float factor, const TextureLookup<K>& at, std::uint32_t lanes,
               std::array<float, K>& out) {
  if (texture == nullptr || factor == 0) {
#pragma omp simd
    for (unsigned i = 0; i < K; ++i) out[i] = (lanes >> i & 1U) != 0 ? factor : out[i];
    return;
  }
  const std::array<float, K> light = texture->template sample<K>(at, lanes);
#pragma omp simd
  for (unsigned i = 0; i < K; ++i) out[i] = (lanes >> i & 1U) != 0 ? factor * light[i] : out[i];
}

/// The base colour and the emission of the surfaces, and whether they are lit.
template <int K>
struct SurfaceColours {
  alignas(64) std::array<float, K> base, emission;
  std::uint32_t unlit = 0;  // a bit per lane

  /// Looks them up for the lanes in `hits`, material by material.
  void look_up(const RaycastScene& scene, const std::array<std::uint32_t, K>& materials, const TextureLookup<K>& at,
               std::uint32_t hits) {
    unlit = 0;
    while (hits != 0) {
      const std::uint32_t current = materials[static_cast<std::size_t>(std::countr_zero(hits))];
      const std::uint32_t same = lanes_equal<K>(materials.data(), current) & hits;
      hits &= ~same;
      const Material& material = scene.material(current);
      fill_mean<K>(material.texture.get(), material.base, at, same, base);
      fill_mean<K>(material.emission_texture.get(), material.emission, at, same, emission);
      if (material.unlit) unlit |= same;
    }
  }
};

}  // namespace esim::inline backends::inline raycast
