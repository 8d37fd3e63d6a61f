#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "esim/backends/raycast/lights.h"

// Private to backends/raycast.
/// From what rays have hit to irradiance.
namespace esim::inline backends::inline raycast {

/// The scene at one time, seen from one pose.
struct Moment {
  std::vector<PlacedGroup> groups;
  std::optional<Lighting> lighting;  // in the camera frame

  Moment(const RaycastScene& scene, const RenderRequest& request)
      : groups(scene.place(request)), lighting(scene.lighting()) {
    if (lighting) lighting = in_camera_frame(*lighting, groups[0]);
  }
};

inline std::vector<Moment> moments_of(const RaycastScene& scene, std::span<const RenderRequest> requests) {
  std::vector<Moment> moments;
  for (const RenderRequest& request : requests) moments.emplace_back(scene, request);
  return moments;
}

/// K rays in the stages of rendering.
template <int K>
struct Rays {
  const RayBlock* block;
  int first;                            // of the block's lanes
  const std::uint32_t* first_material;  // per lane, for its pixel's colour; null: luminance
  Packet<K> packet;
  std::uint32_t hits;                                 // a bit per lane, like `lit`
  std::uint32_t lit;                                  // lanes whose surfaces are lit
  alignas(64) std::array<std::uint32_t, K> triangle;  // index in the scene; 0 without a hit
  TextureLookup<K> at;
  alignas(64) std::array<std::uint32_t, K> material;
  SurfaceColours<K> colours;
  alignas(64) std::array<float, K> light;  // that the surface receives
  alignas(64) std::array<float, K> irradiance;
};

/// Computes the irradiance of rays.
class Shading {
 public:
  /// `background`: irradiance of rays without a hit. The scene must outlive it.
  Shading(const RaycastScene& scene, float background) : scene_(scene), background_(background) {}

  /// Processes the rays in stages, so that memory for a stage arrives while other rays are in the previous one. Each
  /// ray covers `footprint` of the footprint's sides.
  template <int K, typename W>
  void shade(const Moment& moment, std::span<W> batch, float footprint) const {
    GroupRotations<K> rotations;
    for (W& work : batch) locate(moment, rotations, footprint, work.rays);
    for (W& work : batch) shade(moment, rotations, work.rays);
  }

  /// Computes the light on the surfaces that the lanes of `lit` have hit.
  template <int K>
  void light_up(const Moment& moment, GroupRotations<K>& rotations, std::uint32_t lit, Rays<K>& rays) const {
    rotations.select(rays.packet, moment.groups);
    SurfacePoints<K> surface;
    surface.take(scene_, rays.packet, rays.triangle, rotations);
    const std::array<float, K> light = LightOnSurfaces<K>(*moment.lighting, moment.groups).at(surface, lit);
    for (unsigned i = 0; i < K; ++i) rays.light[i] = (lit >> i & 1U) != 0 ? light[i] : rays.light[i];
  }

  /// Looks up where the rays hit textures.
  template <int K>
  void locate(const Moment& moment, GroupRotations<K>& rotations, float footprint, Rays<K>& rays) const {
    if (rays.hits == 0) return;
    HitTriangles<K> triangles;
    triangles.gather(scene_, rays.triangle);
    rotations.select(rays.packet, moment.groups);
    locate_on_textures<K>(rays.packet, *rays.block, rays.first, footprint, rotations, triangles, rays.at);
    rays.material = triangles.material;
    if (rays.first_material == nullptr) return;
    for (unsigned i = 0; i < K; ++i) rays.material[i] += rays.first_material[i];
  }

  /// Looks up the colours of what they hit, and computes the light on it.
  template <int K>
  void colour(const Moment& moment, GroupRotations<K>& rotations, Rays<K>& rays) const {
    rays.colours.look_up(scene_, rays.material, rays.at, rays.hits);
    rays.light.fill(1);
    rays.lit = moment.lighting ? rays.hits & ~rays.colours.unlit : 0;
    if (rays.lit != 0) light_up(moment, rotations, rays.lit, rays);
  }

 private:
  template <int K>
  void shade(const Moment& moment, GroupRotations<K>& rotations, Rays<K>& rays) const {
    colour(moment, rotations, rays);
    const SurfaceColours<K>& colours = rays.colours;
    const std::uint32_t hits = rays.hits;
    const float background = background_;
#pragma omp simd
    for (unsigned i = 0; i < K; ++i) {
      const float seen = colours.base[i] * rays.light[i] + colours.emission[i];
      rays.irradiance[i] = (hits >> i & 1U) != 0 ? seen : background;
    }
  }

  const RaycastScene& scene_;
  float background_;
};

}  // namespace esim::inline backends::inline raycast
