#pragma once

#include <hwy/highway.h>

#include <array>
#include <cstdint>
#include <span>

#include "esim/backends/raycast/embree.h"
#include "esim/backends/raycast/raycast_scene.h"

// Private to backends/raycast: includes hwy/highway.h.
namespace esim::inline backends::inline raycast {

/// A bit for each of K lanes.
template <int K>
inline constexpr std::uint32_t kEveryLane = (1U << K) - 1;

/// A bit per lane that has the value.
template <int K>
std::uint32_t lanes_equal(const std::uint32_t* values, std::uint32_t value) {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::CappedTag<std::uint32_t, K> d;
  std::uint32_t lanes = 0;
  for (std::size_t i = 0; i < K; i += hn::Lanes(d)) {
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(d, hn::Eq(hn::Load(d, values + i), hn::Set(d, value)), bits);
    lanes |= (bits[0] | std::uint32_t{bits[1]} << 8) << i;
  }
  return lanes;
}

/// A ray of each of K neighbouring pixels, and what they hit.
template <int K>
struct Packet {
  alignas(64) std::array<float, K> bearing_x, bearing_y;  // in the camera frame; z = 1
  embree::RayHits<K> ray;

  /// Sets one ray per pixel of the block from its lane `first` on, through the point at `offset` from the pixel's
  /// centre, without hits.
  void aim(const RayBlock& block, int first, const Eigen::Vector2f& offset);

  /// Finds the nearest triangle of the group that each ray hits, if it is nearer than previous hits. As bearings have
  /// z = 1 in the camera frame, the ray's parameter is the planar depth.
  void intersect(const PlacedGroup& placed, unsigned group);

  /// As above, with these triangles as the only candidates, by testing every ray against all of them.
  void intersect(const PlacedGroup& placed, unsigned group, std::span<const SeenTriangle> triangles);

  /// The group of a RaycastScene that a lane has hit; 0 without a hit.
  unsigned group(unsigned lane) const { return ray.hit.instID[0][lane]; }

  /// A bit per lane with a hit.
  std::uint32_t hits() const { return ~lanes_equal<K>(ray.hit.geomID, RTC_INVALID_GEOMETRY_ID) & kEveryLane<K>; }

 private:
  static constexpr float kNearest = 1e-3F;  // m; closer surfaces are invisible

  /// Transforms the rays to the frame of a group.
  void turn(const PlacedGroup& placed);
};

/// For Embree: every lane has a ray.
template <int K>
inline constexpr auto kAllLanes = [] {
  struct {
    alignas(64) std::array<int, K> valid;
  } lanes{};
  lanes.valid.fill(-1);
  return lanes;
}();

template <int K>
void Packet<K>::aim(const RayBlock& block, int first, const Eigen::Vector2f& offset) {
  const float sx = offset.x(), sy = offset.y();
#pragma omp simd
  for (int i = 0; i < K; ++i) {
    bearing_x[i] = block.x[first + i] + block.dx_du[first + i] * sx + block.dx_dv[first + i] * sy;
    bearing_y[i] = block.y[first + i] + block.dy_du[first + i] * sx + block.dy_dv[first + i] * sy;
    ray.ray.tfar[i] = kInfinity;
    ray.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    ray.hit.instID[0][i] = 0;
  }
}

template <int K>
void Packet<K>::turn(const PlacedGroup& placed) {
  const Eigen::Matrix3f& R = placed.R_group_camera;
  const float r00 = R(0, 0), r01 = R(0, 1), r02 = R(0, 2);
  const float r10 = R(1, 0), r11 = R(1, 1), r12 = R(1, 2);
  const float r20 = R(2, 0), r21 = R(2, 1), r22 = R(2, 2);
#pragma omp simd
  for (int i = 0; i < K; ++i) {
    const float bx = bearing_x[i], by = bearing_y[i];
    ray.ray.dir_x[i] = r00 * bx + r01 * by + r02;
    ray.ray.dir_y[i] = r10 * bx + r11 * by + r12;
    ray.ray.dir_z[i] = r20 * bx + r21 * by + r22;
  }
}

template <int K>
void Packet<K>::intersect(const PlacedGroup& placed, unsigned group) {
  turn(placed);
  const float ox = placed.camera.x(), oy = placed.camera.y(), oz = placed.camera.z();
#pragma omp simd
  for (int i = 0; i < K; ++i) {
    ray.ray.org_x[i] = ox, ray.ray.org_y[i] = oy, ray.ray.org_z[i] = oz;
    ray.ray.tnear[i] = kNearest;
    ray.ray.time[i] = 0;
    ray.ray.mask[i] = ~0U;
    ray.ray.id[i] = 0;
    ray.ray.flags[i] = 0;
  }
  embree::intersect<K>(kAllLanes<K>.valid.data(), placed.triangles().rays.scene(), group, ray);
}

template <int K>
void Packet<K>::intersect(const PlacedGroup& placed, unsigned group, std::span<const SeenTriangle> triangles) {
  if (triangles.empty()) return;
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::CappedTag<float, K> d;
  using V = hn::Vec<decltype(d)>;
  constexpr std::size_t kVector = hn::MaxLanes(decltype(d)());
  const hn::RebindToUnsigned<decltype(d)> du;
  const V nearest = hn::Set(d, kNearest);
  for (std::size_t i = 0; i < K; i += kVector) {
    const V x = hn::Load(d, &bearing_x[i]), y = hn::Load(d, &bearing_y[i]);
    const auto along = [&](const std::array<float, 3>& v) {
      return hn::MulAdd(hn::Set(d, v[0]), x, hn::MulAdd(hn::Set(d, v[1]), y, hn::Set(d, v[2])));
    };
    V depth = hn::Load(d, ray.ray.tfar + i), facing = hn::Set(d, 1), u = hn::Zero(d), v = u;
    V normal_x = u, normal_y = u, normal_z = u;
    auto index = hn::Zero(du);
    auto hit = hn::Lt(u, u);
    for (const SeenTriangle& triangle : triangles) {
      const V w0 = along(triangle.weight[0]), w1 = along(triangle.weight[1]), w2 = along(triangle.weight[2]);
      const V this_facing = along(triangle.facing);
      const V min = hn::Min(hn::Min(w0, w1), w2);
      auto nearer = hn::And(hn::Ge(min, hn::Zero(d)), hn::Gt(this_facing, hn::Set(d, triangle.min_facing)));
      if (hn::AllFalse(d, nearer)) continue;
      const V this_depth = hn::Div(hn::Set(d, triangle.distance), this_facing);
      nearer = hn::And(nearer, hn::And(hn::Ge(this_depth, nearest), hn::Lt(this_depth, depth)));
      const auto take = [&](V& to, V from) { to = hn::IfThenElse(nearer, from, to); };
      take(depth, this_depth), take(facing, this_facing), take(u, w1), take(v, w2);
      take(normal_x, hn::Set(d, triangle.normal[0])), take(normal_y, hn::Set(d, triangle.normal[1]));
      take(normal_z, hn::Set(d, triangle.normal[2]));
      index = hn::IfThenElse(hn::RebindMask(du, nearer), hn::Set(du, triangle.index), index);
      hit = hn::Or(hit, nearer);
    }
    if (hn::AllFalse(d, hit)) continue;
    const auto write = [&](V value, float* to) { hn::BlendedStore(value, hit, d, to + i); };
    const V per_facing = hn::Div(hn::Set(d, 1), facing);
    write(depth, ray.ray.tfar), write(hn::Mul(u, per_facing), ray.hit.u), write(hn::Mul(v, per_facing), ray.hit.v);
    write(normal_x, ray.hit.Ng_x), write(normal_y, ray.hit.Ng_y), write(normal_z, ray.hit.Ng_z);
    const auto hit_bits = hn::RebindMask(du, hit);
    hn::BlendedStore(index, hit_bits, du, ray.hit.primID + i);
    hn::BlendedStore(hn::Zero(du), hit_bits, du, ray.hit.geomID + i);
    hn::BlendedStore(hn::Set(du, group), hit_bits, du, ray.hit.instID[0] + i);
  }
  turn(placed);
}

}  // namespace esim::inline backends::inline raycast
