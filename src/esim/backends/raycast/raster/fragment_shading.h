#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <span>
#include <vector>

#include "esim/backends/raycast/raster/coverage.h"
#include "esim/backends/raycast/shading.h"

// Private to backends/raycast.
namespace esim::inline backends::inline raycast {

/// Computes the irradiance of the fragments of a cell, K at a time.
template <int K>
class FragmentShading {
 public:
  /// `side` of the square that edges are averaged over, in footprints; `samples`: positions at which shadows are
  /// tested in a pixel that the edge of a shadow crosses. All arguments must outlive it.
  FragmentShading(const RaycastScene& scene, const Moment& moment, float side, const PixelSamples& samples)
      : scene_(scene), moment_(moment), shading_(scene, 0), side_(side), samples_(samples), batch_(kBatch) {}

  /// `mosaic`: each pixel sees the materials in the colour of its filter.
  void shade(const CellSurfaces& surfaces, const ImageCell& cell, std::span<const Fragment> fragments, bool mosaic) {
    base_.resize(fragments.size()), emission_.resize(fragments.size()), light_.resize(fragments.size());
    lit_.resize(fragments.size());
    mosaic_ = mosaic;
    if (moment_.glossy()) shine_.resize(fragments.size());
    for (std::size_t first = 0; first < fragments.size(); first += K * kBatch) {
      const std::span<const Fragment> some = fragments.subspan(first, std::min(K * kBatch, fragments.size() - first));
      const std::size_t packets = (some.size() + K - 1) / K;
      for (std::size_t p = 0; p < packets; ++p) {
        Work& work = batch_[p];
        aim(surfaces, cell, some.subspan(p * K, std::min<std::size_t>(K, some.size() - p * K)), mosaic, work);
        shading_.template locate<K>(moment_, rotations_, 1, work.rays);
      }
      for (std::size_t p = 0; p < packets; ++p) {
        Rays<K>& rays = batch_[p].rays;
        shading_.template colour<K>(moment_, rotations_, rays);
        const std::size_t begin = first + p * K, count = std::min<std::size_t>(K, fragments.size() - begin);
        std::copy_n(rays.colours.base.begin(), count, base_.begin() + static_cast<std::ptrdiff_t>(begin));
        std::copy_n(rays.colours.emission.begin(), count, emission_.begin() + static_cast<std::ptrdiff_t>(begin));
        std::copy_n(rays.light.begin(), count, light_.begin() + static_cast<std::ptrdiff_t>(begin));
        for (std::size_t i = 0; i < count; ++i) lit_[begin + i] = (rays.lit >> i & 1U) != 0;
        if (moment_.glossy())
          std::copy_n(rays.shine.begin(), count, shine_.begin() + static_cast<std::ptrdiff_t>(begin));
      }
    }
    if (moment_.lighting && moment_.lighting->shadows) smooth_shadows(surfaces, cell, fragments);
    if (!moment_.glossy()) return;
    for (std::size_t f = 0; f < fragments.size(); ++f) emission_[f] += shine_[f];
  }

  float irradiance(std::size_t fragment) const { return base_[fragment] * light_[fragment] + emission_[fragment]; }

 private:
  static constexpr std::size_t kBatch = 8;  // packets

  struct Work {
    RayBlock block;
    Rays<K> rays;
    alignas(64) std::array<std::uint32_t, K> first_material;
  };

  /// Makes rays to the centroids of up to K fragments.
  void aim(const CellSurfaces& surfaces, const ImageCell& cell, std::span<const Fragment> fragments, bool mosaic,
           Work& work) const {
    Rays<K>& rays = work.rays;
    rays.block = &work.block, rays.first = 0;
    rays.first_material = mosaic ? work.first_material.data() : nullptr;
    rays.hits = static_cast<std::uint32_t>((std::uint64_t{1} << fragments.size()) - 1);
    auto& hit = rays.packet.ray.hit;
    alignas(64) std::array<std::array<float, 4>, K> at;  // the weights, and the inverse depth
    alignas(64) std::array<float, K> dx_ds, dx_dt, dy_ds, dy_dt, ss, st, tt;
    const hn::FixedTag<float, 4> d;
    const float per_side = 1 / side_;
    for (std::size_t i = 0; i < K; ++i) {
      const Fragment& fragment = fragments[std::min(i, fragments.size() - 1)];
      const ScreenTriangle& triangle = surfaces.triangle(fragment.triangle);
      const std::size_t k = fragment.pixel;
      const auto [s, t] = fragment.centroid;
      const float x = cell.x[k] + cell.dx_du[k] * s + cell.dx_dv[k] * t;
      const float y = cell.y[k] + cell.dy_du[k] * s + cell.dy_dv[k] * t;
      rays.packet.bearing_x[i] = x, rays.packet.bearing_y[i] = y;
      const auto of_y = hn::MulAdd(hn::Load(d, triangle.y.data()), hn::Set(d, y), hn::Load(d, triangle.one.data()));
      hn::Store(hn::MulAdd(hn::Load(d, triangle.x.data()), hn::Set(d, x), of_y), d, at[i].data());
      hit.Ng_x[i] = triangle.normal[0], hit.Ng_y[i] = triangle.normal[1], hit.Ng_z[i] = triangle.normal[2];
      hit.instID[0][i] = triangle.group;
      rays.triangle[i] = triangle.index;
      dx_ds[i] = cell.dx_du[k], dx_dt[i] = cell.dx_dv[k], dy_ds[i] = cell.dy_du[k], dy_dt[i] = cell.dy_dv[k];
      ss[i] = fragment.spread.ss, st[i] = fragment.spread.st, tt[i] = fragment.spread.tt;
      if (mosaic) {
        const int column = fragment.pixel % ImageCell::kWidth, row = fragment.pixel / ImageCell::kWidth;
        work.first_material[i] = scene_.first_material(colour_at(column, row));
      }
    }
#pragma omp simd
    for (std::size_t i = 0; i < K; ++i) {
      const float sum = at[i][0] + at[i][1] + at[i][2], per_sum = sum > 0 ? 1 / sum : 0.0F;
      hit.u[i] = at[i][1] * per_sum, hit.v[i] = at[i][2] * per_sum;
      rays.packet.ray.ray.tfar[i] = 1 / at[i][3];
      const Footprint print = footprint(ss[i], st[i], tt[i]);
      const float u_s = per_side * print.u_s, u_t = per_side * print.u_t, v_t = per_side * print.v_t;
      work.block.dx_du[i] = u_s * dx_ds[i] + u_t * dx_dt[i], work.block.dx_dv[i] = v_t * dx_dt[i];
      work.block.dy_du[i] = u_s * dy_ds[i] + u_t * dy_dt[i], work.block.dy_dv[i] = v_t * dy_dt[i];
    }
    for (const std::uint32_t index : rays.triangle) moment_.triangles->prefetch(index);
  }

  /// Sides of the parallelogram over which the texture of a fragment is averaged, in footprints of a complete pixel:
  /// u = (u_s, u_t) and v = (0, v_t).
  struct Footprint {
    float u_s, u_t, v_t;
  };

  /// The parallelogram whose positions vary like those of the fragment, and in addition by what the footprint of a
  /// complete pixel exceeds the square that edges are averaged over: all fragments of a pixel together are as sharp as
  /// a pixel without edges, and each sees little of the texture beside what it covers.
  Footprint footprint(float spread_ss, float spread_st, float spread_tt) const {
    constexpr float kSquare = 12, kSmallest = 1e-6F;
    const float of_edges = side_ * side_, others = 1 - of_edges;
    const float ss = std::max(others + of_edges * kSquare * spread_ss, kSmallest), st = of_edges * kSquare * spread_st;
    const float tt = others + of_edges * kSquare * spread_tt;
    const float u_s = std::sqrt(ss), u_t = st / u_s;
    return {u_s, u_t, std::sqrt(std::max(tt - u_t * u_t, kSmallest))};
  }

  /// Averages the light over the samples of fragments in which it may vary.
  void smooth_shadows(const CellSurfaces& surfaces, const ImageCell& cell, std::span<const Fragment> fragments) {
    constexpr float kOtherLight = 0.9F, kWhole = 0.9999F;
    static constexpr std::array<PixelPoint, 4> kCorners = {PixelPoint{-0.5F, -0.5F}, PixelPoint{0.5F, -0.5F},
                                                           PixelPoint{-0.5F, 0.5F}, PixelPoint{0.5F, 0.5F}};
    probes_.clear();
    for (std::size_t f = 0; f < fragments.size(); ++f) {
      if (lit_[f] == 0 || fragments[f].area < kWhole) continue;
      for (const PixelPoint& corner : kCorners) probes_.push_back({f, corner});
    }
    light_up(surfaces, cell, fragments);
    samples_of_.clear();
    std::size_t next = 0;
    for (std::size_t f = 0; f < fragments.size(); ++f) {
      if (lit_[f] == 0) continue;
      bool varies = fragments[f].area < kWhole;
      for (; next < probes_.size() && probes_[next].fragment == f; ++next) {
        const float a = light_[f], b = probes_[next].light;
        varies = varies || std::min(a, b) < kOtherLight * std::max(a, b);
      }
      if (varies) samples_of_.push_back(f);
    }
    probes_.clear();
    for (const std::size_t f : samples_of_) {
      for (std::uint64_t left = fragments[f].samples; left != 0; left &= left - 1)
        probes_.push_back({f, samples_[static_cast<std::size_t>(std::countr_zero(left))]});
    }
    light_up(surfaces, cell, fragments);
    for (std::size_t p = 0; p < probes_.size();) {
      const std::size_t f = probes_[p].fragment;
      float sum = 0, shine = 0, count = 0;
      for (; p < probes_.size() && probes_[p].fragment == f; ++p)
        sum += probes_[p].light, shine += probes_[p].shine, count += 1;
      light_[f] = sum / count;
      if (moment_.glossy()) shine_[f] = shine / count;
    }
  }

  /// Computes the light at the probes.
  void light_up(const CellSurfaces& surfaces, const ImageCell& cell, std::span<const Fragment> fragments) {
    std::array<Fragment, K> at;
    Work& work = batch_[0];
    for (std::size_t first = 0; first < probes_.size(); first += K) {
      const std::size_t count = std::min<std::size_t>(K, probes_.size() - first);
      for (std::size_t i = 0; i < count; ++i) {
        at[i] = fragments[probes_[first + i].fragment];
        at[i].centroid = probes_[first + i].place;
      }
      aim(surfaces, cell, std::span(at).first(count), mosaic_ && moment_.glossy(), work);
      if (moment_.glossy()) shading_.template locate<K>(moment_, rotations_, 1, work.rays);
      shading_.template light_up<K>(moment_, rotations_, work.rays.hits, work.rays);
      for (std::size_t i = 0; i < count; ++i) {
        probes_[first + i].light = work.rays.light[i];
        if (moment_.glossy()) probes_[first + i].shine = work.rays.shine[i];
      }
    }
  }

  struct Probe {
    std::size_t fragment;
    PixelPoint place;
    float light = 0, shine = 0;
  };

  const RaycastScene& scene_;
  const Moment& moment_;
  Shading shading_;
  float side_;
  const PixelSamples& samples_;
  std::vector<Work> batch_;
  GroupRotations<K> rotations_;

  // Of each fragment.
  std::vector<float> base_, emission_, light_, shine_;
  std::vector<std::uint8_t> lit_;

  bool mosaic_ = false;
  std::vector<Probe> probes_;
  std::vector<std::size_t> samples_of_;
};

}  // namespace esim::inline backends::inline raycast
