#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "esim/backends/raycast/glossy_light.h"
#include "esim/backends/raycast/sky.h"
#include "esim/render/bands.h"
#include "esim/render/motion_field.h"

// Private to backends/raycast.
/// From what rays have hit to irradiance.
namespace esim::inline backends::inline raycast {

/// The scene at one time, seen from one pose.
struct Moment {
  std::vector<PlacedGroup> groups;
  std::shared_ptr<const SceneTriangles> triangles;
  std::optional<Lighting> lighting;  // in the camera frame
  std::optional<Sky> sky;            // instead of the background

  Moment(const RaycastScene& scene, const RenderRequest& request) {
    PlacedGroups placed = scene.place(request);
    groups = std::move(placed.groups), triangles = std::move(placed.triangles);
    if (!scene.lighting()) return;
    std::vector<SE3> objects;
    for (const Kinematics& object : request.objects) objects.push_back(object.T_world_body);
    lighting = in_camera_frame(lighting_at(*scene.lighting(), request.t, objects), groups[0]);
    if (lighting->environment_visible) sky.emplace(*lighting->environment, groups[0].R_group_camera);
  }

  bool glossy() const { return lighting && lighting->glossy; }
};

/// Adds to V how the surfaces of deforming objects move in the objects' frames.
inline void add_deformation(const Moment& moment, const PixelRays& rays, const Tile& tile, int every, Sample& sample) {
  const int first = (tile.y + every - 1) / every * every;
  for (int y = first; y < tile.y + tile.height; y += every) {
    for (int x = tile.x; x < tile.x + tile.width; ++x) {
      const PlacedGroup& group = moment.groups[sample.object(x, y)];
      if (group.deforming == nullptr) continue;
      const Eigen::Vector3f velocity = group.deforming->velocity(sample.surface(x, y));
      add_to_motion_field(rays, x, y, group.R_camera_group * velocity, sample);
    }
  }
}

inline std::vector<Moment> moments_of(const RaycastScene& scene, std::span<const RenderRequest> requests) {
  std::vector<Moment> moments;
  for (const RenderRequest& request : requests) moments.emplace_back(scene, request);
  return moments;
}

/// Renders in bands, and fills V; `shade` fills all other fields.
template <class Shade>
void render_moments(const RaycastScene& scene, std::span<const RenderRequest> requests, const PixelRays& rays,
                    const Workers& workers, Sample& sample, const Shade& shade) {
  const std::vector<Moment> moments = moments_of(scene, requests);
  std::vector<std::vector<Twist>> twists;
  for (const RenderRequest& request : requests) twists.push_back(relative_twists(request));
  const auto render = [&](std::size_t which, const Tile& band) {
    shade(moments[which], band);
    const int every = requests[which].motion_rows;
    motion_field(rays, twists[which], band, sample, every);
    if (scene.deforms()) add_deformation(moments[which], rays, band, every, sample);
  };
  render_in_bands(requests, rays.x.width(), rays.x.height(), workers, sample, render, scene.deforms());
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
  alignas(64) std::array<float, K> light;  // that the surface receives: the factor on its base colour
  alignas(64) std::array<float, K> shine;  // what a glossy surface reflects in addition; 0 if it is not lit
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
    for (W& work : batch) shade(moment, rotations, footprint, work.rays);
  }

  /// Computes the light on the surfaces that the lanes of `lit` have hit. If surfaces are glossy, locate() must have
  /// been called.
  template <int K>
  void light_up(const Moment& moment, GroupRotations<K>& rotations, std::uint32_t lit, Rays<K>& rays) const {
    rotations.select(rays.packet, moment.groups);
    if (moment.glossy()) return light_up_glossy(moment, rotations, lit, rays);
    SurfacePoints<K> surface;
    surface.take(*moment.triangles, rays.packet, rays.triangle, rotations);
    const std::array<float, K> light = LightOnSurfaces<K>(*moment.lighting, moment.groups).at(surface, lit);
    for (unsigned i = 0; i < K; ++i) rays.light[i] = (lit >> i & 1U) != 0 ? light[i] : rays.light[i];
  }

  /// Looks up where the rays hit textures.
  template <int K>
  void locate(const Moment& moment, GroupRotations<K>& rotations, float footprint, Rays<K>& rays) const {
    if (rays.hits == 0) return;
    HitTriangles<K> triangles;
    triangles.gather(*moment.triangles, rays.triangle);
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
    if (moment.glossy()) rays.shine.fill(0);
    rays.lit = moment.lighting ? rays.hits & ~rays.colours.unlit : 0;
    if (rays.lit != 0) light_up(moment, rotations, rays.lit, rays);
  }

  /// The views of the environment that lanes see (see Environment::view_offset).
  template <int K>
  std::array<std::uint8_t, K> views_of(const std::uint32_t* first_material) const {
    std::array<std::uint8_t, K> views{};
    if (first_material == nullptr) return views;
    for (unsigned i = 0; i < K; ++i) views[i] = scene_.view(first_material[i]);
    return views;
  }

 private:
  template <int K>
  void light_up_glossy(const Moment& moment, const GroupRotations<K>& rotations, std::uint32_t lit,
                       Rays<K>& rays) const {
    GlossySurface<K> surface;
    surface.take(scene_, *moment.triangles, rays.packet, rays.triangle, rays.material, rays.at, rotations, lit);
    const Reflected<K> reflected =
        LightOnGlossySurfaces<K>(*moment.lighting, moment.groups).at(surface, views_of<K>(rays.first_material), lit);
    for (unsigned i = 0; i < K; ++i) {
      rays.light[i] = (lit >> i & 1U) != 0 ? reflected.of_base[i] : rays.light[i];
      rays.shine[i] = (lit >> i & 1U) != 0 ? reflected.other[i] : rays.shine[i];
    }
  }

  template <int K>
  void shade(const Moment& moment, GroupRotations<K>& rotations, float footprint, Rays<K>& rays) const {
    colour(moment, rotations, rays);
    SurfaceColours<K>& colours = rays.colours;
    const std::uint32_t hits = rays.hits;
    if (moment.glossy()) {
      for (unsigned i = 0; i < K; ++i) colours.emission[i] += rays.shine[i];
    }
    const float background = background_;
#pragma omp simd
    for (unsigned i = 0; i < K; ++i) {
      const float seen = colours.base[i] * rays.light[i] + colours.emission[i];
      rays.irradiance[i] = (hits >> i & 1U) != 0 ? seen : background;
    }
    if (moment.sky && hits != kEveryLane<K>) show_sky(*moment.sky, footprint, rays);
  }

  template <int K>
  void show_sky(const Sky& sky, float footprint, Rays<K>& rays) const {
    SkyRays<K> seen;
    const RayBlock& block = *rays.block;
    for (unsigned i = 0; i < K; ++i) {
      const unsigned k = static_cast<unsigned>(rays.first) + i;
      seen.x[i] = rays.packet.bearing_x[i], seen.y[i] = rays.packet.bearing_y[i];
      seen.dx_du[i] = footprint * block.dx_du[k], seen.dx_dv[i] = footprint * block.dx_dv[k];
      seen.dy_du[i] = footprint * block.dy_du[k], seen.dy_dv[i] = footprint * block.dy_dv[k];
    }
    const std::array<float, K> radiance = sky.radiance<K>(seen, views_of<K>(rays.first_material));
    for (unsigned i = 0; i < K; ++i) rays.irradiance[i] = (rays.hits >> i & 1U) != 0 ? rays.irradiance[i] : radiance[i];
  }

  const RaycastScene& scene_;
  float background_;
};

}  // namespace esim::inline backends::inline raycast
