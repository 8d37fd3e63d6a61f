#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "esim/backends/raycast/glossy_surface.h"
#include "esim/scene/environment/environment.h"
#include "esim/scene/environment/split_sum.h"

// Private to backends/raycast.
namespace esim::inline backends::inline raycast {

/// What glossy surfaces reflect. Their radiance is affine in the base colour: base * of_base + other.
template <int K>
struct Reflected {
  alignas(64) std::array<float, K> of_base, other;
};

/// Light on glossy surfaces, by the model of glTF 2.0 (Khronos, "Specification", B.2 and B.3): a dielectric layer over
/// a diffuse surface, mixed with a metal. With the Fresnel term of Schlick, s = (1 - <v, h>)^5, and R = strength times
/// <n, l> pi D V,
///     dielectric: base strength <n, l> (1 - F) + R F,  F = F0 + (F90 - F0) s
///     metal:      R (base + (1 - base) s)
template <int K>
class LightOnGlossySurfaces {
 public:
  /// `lighting` is in the camera frame. `views`: per lane, of the environment; see Environment::view_offset().
  LightOnGlossySurfaces(const Lighting& lighting, const std::vector<PlacedGroup>& groups)
      : lighting_(lighting), R_world_camera_(groups[0].R_group_camera), shadow_rays_(groups) {}

  Reflected<K> at(const GlossySurface<K>& surface, const std::array<std::uint8_t, K>& views,
                  std::uint32_t lanes) const {
    Reflected<K> sum;
    sum.of_base.fill(0), sum.other.fill(0);
    VectorLanes<K> to_light;
    alignas(64) std::array<float, K> received;
    for (const SunLight& sun : lighting_.suns) {
      to_light.x.fill(-sun.direction.x()), to_light.y.fill(-sun.direction.y()), to_light.z.fill(-sun.direction.z());
      received.fill(sun.strength);
      add(surface, to_light, received, kInfinity, 0, lanes, sum);
    }
    for (const PointLight& lamp : lighting_.points) {
      aim(surface, lamp.position, to_light);
#pragma omp simd
      for (int i = 0; i < K; ++i) received[i] = lamp.strength / squared_distance(to_light, i);
      add(surface, to_light, received, kToLamp, 0, lanes, sum);
    }
    for (const AreaLight& area : lighting_.areas) add_area(surface, area, lanes, sum);
    if (lighting_.environment != nullptr) add_environment(surface, views, sum);
    if (lighting_.ambient > 0) add_ambient(surface, sum);
    return sum;
  }

 private:
  static void aim(const GlossySurface<K>& surface, const Eigen::Vector3f& lamp, VectorLanes<K>& to_light) {
#pragma omp simd
    for (int i = 0; i < K; ++i) {
      to_light.x[i] = lamp.x() - surface.at.point.x[i];
      to_light.y[i] = lamp.y() - surface.at.point.y[i];
      to_light.z[i] = lamp.z() - surface.at.point.z[i];
    }
  }

  static float squared_distance(const VectorLanes<K>& to_light, int i) {
    const float x = to_light.x[i], y = to_light.y[i], z = to_light.z[i];
    return std::max(x * x + y * y + z * z, kNearestLamp * kNearestLamp);
  }

  /// Adds what equal parts of a rectangle contribute, each like a lamp at its centre. So that a smooth surface does not
  /// show a row of lamps, the lobe is widened by about the width w of a part, seen from the surface: alpha² by w² / 8.
  void add_area(const GlossySurface<K>& surface, const AreaLight& area, std::uint32_t lanes, Reflected<K>& sum) const {
    const int n = area.samples;
    const float per_sample = area.strength / static_cast<float>(n * n), step = 2 / static_cast<float>(n);
    const float part = 4 * area.half_u.norm() * area.half_v.norm() / static_cast<float>(n * n);  // m²
    VectorLanes<K> to_light;
    alignas(64) std::array<float, K> received;
    alignas(64) std::array<float, K> widening;
    for (int k = 0; k < n * n; ++k) {
      const float s = step * (static_cast<float>(k % n) + 0.5F) - 1, t = step * (static_cast<float>(k / n) + 0.5F) - 1;
      aim(surface, area.position + s * area.half_u + t * area.half_v, to_light);
      const Eigen::Vector3f& d = area.direction;
#pragma omp simd
      for (int i = 0; i < K; ++i) {
        const float squared = squared_distance(to_light, i);
        const float leaving = -(d.x() * to_light.x[i] + d.y() * to_light.y[i] + d.z() * to_light.z[i]);
        const float cosine = std::max(0.0F, leaving) / std::sqrt(squared);
        received[i] = per_sample * cosine / squared;
        widening[i] = 0.125F * part * cosine / squared;
      }
      add(surface, to_light, received, kToLamp, widening.data(), lanes, sum);
    }
  }

  /// Adds light from a direction of any length. `received`: by a surface that faces it. `widening` of alpha², if any.
  void add(const GlossySurface<K>& surface, const VectorLanes<K>& to_light, const std::array<float, K>& received,
           float reach, const float* widening, std::uint32_t lanes, Reflected<K>& sum) const {
    Reflected<K> part;
    const GlossLanes<K>& gloss = surface.gloss;
    const VectorLanes<K>&n = surface.at.normal, &v = surface.view;
#pragma omp simd
    for (int i = 0; i < K; ++i) {
      float lx = to_light.x[i], ly = to_light.y[i], lz = to_light.z[i];
      const float per_length = 1 / std::sqrt(lx * lx + ly * ly + lz * lz);
      lx *= per_length, ly *= per_length, lz *= per_length;
      const float n_l = std::max(0.0F, n.x[i] * lx + n.y[i] * ly + n.z[i] * lz), n_v = surface.cosine_view[i];
      // h = l + v, whose length is 2 <v, h>. The sine of its angle to n is more accurate than 1 minus the cosine².
      const float hx = lx + v.x[i], hy = ly + v.y[i], hz = lz + v.z[i];
      const float h2 = std::max(hx * hx + hy * hy + hz * hz, 1e-12F), v_h = 0.5F * std::sqrt(h2);
      const float cx = n.y[i] * hz - n.z[i] * hy, cy = n.z[i] * hx - n.x[i] * hz, cz = n.x[i] * hy - n.y[i] * hx;
      const float sine2 = std::min((cx * cx + cy * cy + cz * cz) / h2, 1.0F);
      const float a2 = widening != nullptr ? std::min(surface.alpha2[i] + widening[i], 1.0F) : surface.alpha2[i];
      const float spread = a2 * (1 - sine2) + sine2;
      const float visibility =
          0.5F / (n_l * std::sqrt(a2 + (1 - a2) * n_v * n_v) + n_v * std::sqrt(a2 + (1 - a2) * n_l * n_l));
      const float arrives = received[i] * n_l, reflected = arrives * a2 / (spread * spread) * visibility;
      const float off = 1 - std::min(v_h, 1.0F), schlick = off * off * off * off * off;
      const float m = gloss.metallic[i];
      const float fresnel = gloss.reflectance[i] + (gloss.edge_reflectance[i] - gloss.reflectance[i]) * schlick;
      part.of_base[i] = (1 - m) * arrives * (1 - fresnel) + m * reflected * (1 - schlick);
      part.other[i] = reflected * ((1 - m) * fresnel + m * schlick);
    }
    if (lighting_.shadows) {
      for (unsigned i = 0; i < K; ++i) {
        if (!(part.of_base[i] + part.other[i] > 0)) lanes &= ~(1U << i);
      }
      lanes = shadow_rays_.visible(surface.at, to_light, reach, lanes);
    }
    for (unsigned i = 0; i < K; ++i) {
      const bool seen = (lanes >> i & 1U) != 0;
      sum.of_base[i] += seen ? part.of_base[i] : 0.0F;
      sum.other[i] += seen ? part.other[i] : 0.0F;
    }
  }

  /// Adds light from everywhere: `diffuse` is what a diffuse surface receives, `lobe` what arrives in the lobe.
  static void add_surroundings(const GlossySurface<K>& surface, std::size_t i, float diffuse, float lobe,
                               Reflected<K>& sum) {
    const GlossLanes<K>& gloss = surface.gloss;
    const auto [scale, offset] = SplitSum::table().at(surface.cosine_view[i], surface.roughness[i]);
    const float m = gloss.metallic[i];
    const float dielectric = gloss.reflectance[i] * scale + gloss.edge_reflectance[i] * offset;
    sum.of_base[i] += (1 - m) * diffuse * (1 - dielectric) + m * lobe * scale;
    sum.other[i] += lobe * ((1 - m) * dielectric + m * offset);
  }

  void add_ambient(const GlossySurface<K>& surface, Reflected<K>& sum) const {
    for (std::size_t i = 0; i < K; ++i) add_surroundings(surface, i, lighting_.ambient, lighting_.ambient, sum);
  }

  void add_environment(const GlossySurface<K>& surface, const std::array<std::uint8_t, K>& views,
                       Reflected<K>& sum) const {
    const Environment& environment = *lighting_.environment;
    const Eigen::Matrix3f& R = R_world_camera_;
    for (std::size_t i = 0; i < K; ++i) {
      const Eigen::Vector3f n(surface.at.normal.x[i], surface.at.normal.y[i], surface.at.normal.z[i]);
      const Eigen::Vector3f v(surface.view.x[i], surface.view.y[i], surface.view.z[i]);
      // A wide lobe leans towards the normal (Lagarde, de Rousiers, "Moving Frostbite to PBR", SIGGRAPH 2014 course).
      const float alpha = std::sqrt(surface.alpha2[i]), smooth = 1 - alpha, lean = smooth * (std::sqrt(smooth) + alpha);
      const Eigen::Vector3f normal = R * n, mirrored = R * (n + lean * (2 * n.dot(v) * n - v - n));
      const float diffuse = environment.diffuse(views[i], normal.x(), normal.y(), normal.z());
      const float lobe = environment.specular(views[i], mirrored.x(), mirrored.y(), mirrored.z(), surface.roughness[i]);
      add_surroundings(surface, i, diffuse, lobe, sum);
    }
  }

  const Lighting& lighting_;
  Eigen::Matrix3f R_world_camera_;
  ShadowRays<K> shadow_rays_;
};

}  // namespace esim::inline backends::inline raycast
