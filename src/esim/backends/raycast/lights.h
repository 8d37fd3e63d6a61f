#pragma once

#include <algorithm>
#include <bit>
#include <optional>

#include "esim/backends/raycast/surface.h"

// Private to backends/raycast.
/// Light on the surfaces that a packet of rays has hit. Vectors are in the camera frame unless stated otherwise.
namespace esim::inline backends::inline raycast {

/// A scene's lighting in a camera's frame; `world` is the group of all static triangles.
inline Lighting in_camera_frame(Lighting lighting, const PlacedGroup& world) {
  for (SunLight& sun : lighting.suns) sun.direction = world.R_camera_group * sun.direction.normalized();
  for (PointLight& point : lighting.points) point.position = world.R_camera_group * (point.position - world.camera);
  for (AreaLight& area : lighting.areas) {
    area.position = world.R_camera_group * (area.position - world.camera);
    for (Eigen::Vector3f* const vector : {&area.half_u, &area.half_v, &area.direction})
      *vector = world.R_camera_group * *vector;
  }
  return lighting;
}

/// Whether a ray meets a box before `reach` times its direction.
inline bool ray_may_meet(const Eigen::AlignedBox3f& box, const Eigen::Vector3f& origin,
                         const Eigen::Vector3f& direction, float reach) {
  constexpr float kRounding = 1e-5F;
  const float margin = kRounding * (origin.lpNorm<1>() + box.sizes().sum());
  float enters = 0, leaves = reach;
  for (int axis = 0; axis < 3; ++axis) {
    const float low = box.min()[axis] - margin - origin[axis], high = box.max()[axis] + margin - origin[axis];
    if (direction[axis] == 0) {
      if (low > 0 || high < 0) return false;
      continue;
    }
    const float a = low / direction[axis], b = high / direction[axis];
    enters = std::max(enters, std::min(a, b)), leaves = std::min(leaves, std::max(a, b));
  }
  return enters <= leaves;
}

/// A vector per lane.
template <int K>
struct VectorLanes {
  alignas(64) std::array<float, K> x, y, z;
};

/// Points on surfaces, with the unit normals on the visible side: the triangle's normal, and the normal for shading,
/// which is interpolated if the mesh has normals.
template <int K>
struct SurfacePoints {
  VectorLanes<K> point, triangle_normal, normal;

  /// Takes the points that the packet has hit; undefined in lanes without a hit.
  void take(const SceneTriangles& scene, const Packet<K>& packet, const std::array<std::uint32_t, K>& triangles,
            const GroupRotations<K>& rotations) {
    normal = normals_of(scene, packet, triangles);
    const auto& R = rotations.element;
    const auto& hit = packet.ray.hit;
#pragma omp simd
    for (int i = 0; i < K; ++i) {
      const float bx = packet.bearing_x[i], by = packet.bearing_y[i], depth = packet.ray.ray.tfar[i];
      point.x[i] = depth * bx, point.y[i] = depth * by, point.z[i] = depth;

      // Rotated into the camera frame, normalised, and turned to the visible side.
      const float gx = R[0][i] * hit.Ng_x[i] + R[1][i] * hit.Ng_y[i] + R[2][i] * hit.Ng_z[i];
      const float gy = R[3][i] * hit.Ng_x[i] + R[4][i] * hit.Ng_y[i] + R[5][i] * hit.Ng_z[i];
      const float gz = R[6][i] * hit.Ng_x[i] + R[7][i] * hit.Ng_y[i] + R[8][i] * hit.Ng_z[i];
      const float towards = gx * bx + gy * by + gz > 0 ? -1.0F : 1.0F;
      const float g_scale = towards / std::sqrt(gx * gx + gy * gy + gz * gz);
      triangle_normal.x[i] = g_scale * gx, triangle_normal.y[i] = g_scale * gy, triangle_normal.z[i] = g_scale * gz;

      const float sx = R[0][i] * normal.x[i] + R[1][i] * normal.y[i] + R[2][i] * normal.z[i];
      const float sy = R[3][i] * normal.x[i] + R[4][i] * normal.y[i] + R[5][i] * normal.z[i];
      const float sz = R[6][i] * normal.x[i] + R[7][i] * normal.y[i] + R[8][i] * normal.z[i];
      const float along = sx * triangle_normal.x[i] + sy * triangle_normal.y[i] + sz * triangle_normal.z[i];
      const float s_scale = (along < 0 ? -1.0F : 1.0F) / std::sqrt(sx * sx + sy * sy + sz * sz);
      normal.x[i] = s_scale * sx, normal.y[i] = s_scale * sy, normal.z[i] = s_scale * sz;
    }
  }

 private:
  /// Normals of any length and on either side, in the frames of the hit groups.
  static VectorLanes<K> normals_of(const SceneTriangles& scene, const Packet<K>& packet,
                                   const std::array<std::uint32_t, K>& triangles) {
    const auto& hit = packet.ray.hit;
    VectorLanes<K> normals;
    for (unsigned i = 0; i < K; ++i) {
      const CornerNormals corner = scene.corner_normals(triangles[i]);
      const float b1 = hit.u[i], b2 = hit.v[i];
      Eigen::Vector3f n = (1 - b1 - b2) * corner[0] + b1 * corner[1] + b2 * corner[2];
      if (!(n.squaredNorm() > 1e-12F)) n = {hit.Ng_x[i], hit.Ng_y[i], hit.Ng_z[i]};
      normals.x[i] = n.x(), normals.y[i] = n.y(), normals.z[i] = n.z();
    }
    return normals;
  }
};

inline constexpr float kNearestLamp = 1e-3F;  // m
inline constexpr float kToLamp = 0.9999F;     // fraction of the distance: the lamp itself casts no shadow

/// Finds which points of surfaces see a light.
template <int K>
class ShadowRays {
 public:
  explicit ShadowRays(const std::vector<PlacedGroup>& groups) : groups_(groups) {}

  /// Those of `lanes` whose points see the light: no triangle crosses the vector to it, up to `reach` times its length.
  std::uint32_t visible(const SurfacePoints<K>& surface, const VectorLanes<K>& to_light, float reach,
                        std::uint32_t lanes) const {
    // Slightly above the surface, by more than the rounding error of the point.
    VectorLanes<K> start;
    const float to_origin = groups_[0].camera.template lpNorm<1>();
    for (unsigned i = 0; i < K; ++i) {
      const float x = surface.point.x[i], y = surface.point.y[i], z = surface.point.z[i];
      const float gap = 2e-5F * (std::fabs(x) + std::fabs(y) + std::fabs(z) + to_origin);
      start.x[i] = x + gap * surface.triangle_normal.x[i];
      start.y[i] = y + gap * surface.triangle_normal.y[i];
      start.z[i] = z + gap * surface.triangle_normal.z[i];
    }
    for (const PlacedGroup& group : groups_) {
      if (lanes == 0) break;
      if (group.deforming != nullptr && !may_meet(group, start, to_light, reach, lanes)) continue;
      if (group.triangles().rays.scene() != nullptr) lanes &= ~occluded(group, start, to_light, reach, lanes);
    }
    return lanes;
  }

 private:
  /// Whether any of the rays of `lanes` may meet the group's box.
  static bool may_meet(const PlacedGroup& group, const VectorLanes<K>& start, const VectorLanes<K>& to_light,
                       float reach, std::uint32_t lanes) {
    for (; lanes != 0; lanes &= lanes - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(lanes));
      const Eigen::Vector3f from(start.x[i], start.y[i], start.z[i]),
          along(to_light.x[i], to_light.y[i], to_light.z[i]);
      if (ray_may_meet(group.box, group.camera + group.R_group_camera * from, group.R_group_camera * along, reach))
        return true;
    }
    return false;
  }

  /// Those of `lanes` whose rays meet a triangle of the group.
  static std::uint32_t occluded(const PlacedGroup& group, const VectorLanes<K>& start, const VectorLanes<K>& to_light,
                                float reach, std::uint32_t lanes) {
    const Eigen::Matrix3f& R = group.R_group_camera;
    embree::Rays<K> ray;
    alignas(64) std::array<int, K> wanted;
    for (unsigned i = 0; i < K; ++i) {
      wanted[i] = (lanes >> i & 1U) != 0 ? -1 : 0;
      Eigen::Vector3f origin = Eigen::Vector3f::Zero(), direction = Eigen::Vector3f::UnitZ();
      if (wanted[i] != 0) {  // other lanes may contain NaN
        origin = group.camera + R * Eigen::Vector3f(start.x[i], start.y[i], start.z[i]);
        direction = R * Eigen::Vector3f(to_light.x[i], to_light.y[i], to_light.z[i]);
      }
      ray.org_x[i] = origin.x(), ray.org_y[i] = origin.y(), ray.org_z[i] = origin.z();
      ray.dir_x[i] = direction.x(), ray.dir_y[i] = direction.y(), ray.dir_z[i] = direction.z();
      ray.tnear[i] = 0, ray.tfar[i] = reach, ray.time[i] = 0;
      ray.mask[i] = ~0U, ray.id[i] = 0, ray.flags[i] = 0;
    }
    embree::occlude<K>(wanted.data(), group.triangles().rays.scene(), ray);
    std::uint32_t found = 0;
    for (unsigned i = 0; i < K; ++i) found |= (ray.tfar[i] < 0 ? 1U : 0U) << i;  // Embree's mark of a hit
    return found;
  }

  const std::vector<PlacedGroup>& groups_;
};

/// The light on surfaces: the bracket of the formula in Lighting.
template <int K>
class LightOnSurfaces {
 public:
  /// `lighting` is in the camera frame.
  LightOnSurfaces(const Lighting& lighting, const std::vector<PlacedGroup>& groups)
      : lighting_(lighting), shadow_rays_(groups) {}

  std::array<float, K> at(const SurfacePoints<K>& surface, std::uint32_t hits) const {
    std::array<float, K> light;
    light.fill(lighting_.ambient);
    VectorLanes<K> to_light;
    alignas(64) std::array<float, K> received;
    for (const SunLight& sun : lighting_.suns) {
      to_light.x.fill(-sun.direction.x()), to_light.y.fill(-sun.direction.y()), to_light.z.fill(-sun.direction.z());
      for (unsigned i = 0; i < K; ++i) received[i] = sun.strength * std::max(0.0F, cosine(surface.normal, to_light, i));
      add_what_arrives(surface, to_light, kInfinity, received, hits, light);
    }
    for (const PointLight& lamp : lighting_.points) {
      for (unsigned i = 0; i < K; ++i) {
        const float x = lamp.position.x() - surface.point.x[i], y = lamp.position.y() - surface.point.y[i],
                    z = lamp.position.z() - surface.point.z[i];
        const float squared = std::max(x * x + y * y + z * z, kNearestLamp * kNearestLamp);
        to_light.x[i] = x, to_light.y[i] = y, to_light.z[i] = z;
        received[i] =
            lamp.strength * std::max(0.0F, cosine(surface.normal, to_light, i)) / (squared * std::sqrt(squared));
      }
      add_what_arrives(surface, to_light, kToLamp, received, hits, light);
    }
    return light;
  }

 private:
  static float cosine(const VectorLanes<K>& n, const VectorLanes<K>& l, unsigned i) {
    return n.x[i] * l.x[i] + n.y[i] * l.y[i] + n.z[i] * l.z[i];
  }

  void add_what_arrives(const SurfacePoints<K>& surface, const VectorLanes<K>& to_light, float reach,
                        const std::array<float, K>& received, std::uint32_t hits, std::array<float, K>& light) const {
    if (lighting_.shadows) {
      for (unsigned i = 0; i < K; ++i) {
        if (!(received[i] > 0)) hits &= ~(1U << i);
      }
      hits = shadow_rays_.visible(surface, to_light, reach, hits);
    }
    for (unsigned i = 0; i < K; ++i) light[i] += (hits >> i & 1U) != 0 ? received[i] : 0.0F;
  }

  const Lighting& lighting_;
  ShadowRays<K> shadow_rays_;
};

}  // namespace esim::inline backends::inline raycast
