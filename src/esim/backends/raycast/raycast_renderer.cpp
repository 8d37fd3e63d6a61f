#include "esim/backends/raycast/raycast_renderer.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <span>

#include "esim/backends/raycast/edges.h"
#include "esim/backends/raycast/sample_places.h"
#include "esim/backends/raycast/shading.h"
#include "esim/render/bands.h"

namespace esim::inline backends::inline raycast {
namespace {

/// The square over which edges are averaged, and the footprint of rays on textures. A single ray averages its texture
/// over the complete footprint. Rays spread over a smaller square each cover the rest of the footprint's variance, or
/// their part of the square, so that surfaces are equally sharp whether an edge enters a pixel or not.
struct Area {
  float side;  // of the square, in footprints

  explicit Area(const PixelArea& area) : side(static_cast<float>(area.edges) / static_cast<float>(area.texture)) {}

  /// The footprint of one of `count` rays in a pixel, in footprints of a single ray.
  float of_one_of(std::size_t count) const {
    return std::sqrt(std::max(1 - side * side, side * side / static_cast<float>(count)));
  }
};

/// The triangles of a group that a cell of the image may see.
struct CellView {
  bool any = false;  // otherwise none
  bool few = false;  // `triangles` are all of them
  std::span<const SeenTriangle> triangles;
};

/// K pixels, seen by the rays through their centres.
template <int K>
struct Work {
  int x, y;  // the block's corner
  Rays<K> rays;
};

/// A pixel that an edge crosses, and its additional rays.
template <int K>
struct EdgeWork {
  Work<K>* pixel;
  unsigned lane;
  RayBlock block;
  Rays<K> rays;
};

/// Writes the values of those of the K pixels that lie in the tile.
template <int K, typename T>
void store(const Work<K>& work, const T* values, const Tile& tile, Image<T>& image) {
  constexpr int kSide = RayBlock::kSide;
  const int top = work.y + work.rays.first / kSide;
  const int end_row = std::min(top + K / kSide, tile.y + tile.height);
  const int left = std::max(work.x, tile.x), right = std::min(work.x + kSide, tile.x + tile.width);
  for (int row = std::max(top, tile.y); row < end_row; ++row) {
    const T* const from = values + (row - top) * kSide;
    if (right - left == kSide) {
      std::copy_n(from, kSide, image.row(row) + left);
    } else {
      std::copy(from + (left - work.x), from + (right - work.x), image.row(row) + left);
    }
  }
}

class RaycastRenderer final : public ProcessorRenderer {
 public:
  RaycastRenderer(std::shared_ptr<const RaycastScene> scene, const RaycastOptions& options, const Camera& camera,
                  const Workers& workers, ColourFilters filters, const PixelArea& area)
      : scene_(std::move(scene)),
        shading_(*scene_, options.background),
        places_(sample_places(options.samples_per_pixel)),
        area_(area),
        rays_(camera, area.texture),
        blocks_(rays_),
        workers_(workers),
        mosaic_(filters == ColourFilters::rggb && scene_->has_colours()) {
    for (int i = 0; i < RayBlock::kPixels; ++i) {
      const std::size_t colour = colour_at(i % RayBlock::kSide, i / RayBlock::kSide);
      first_material_[static_cast<std::size_t>(i)] = scene_->first_material(colour);
      first_material_of_edges_[colour].fill(scene_->first_material(colour));
    }
  }

  RendererTraits traits() const override {
    return {.name = "mesh",
            .granularity = Granularity::tile,
            .at_infinity = false,
            .engine = "raycast",
            .deforms = scene_->deforms()};
  }

 private:
  void compute(std::span<const RenderRequest> requests, Sample& sample) const override {
    render_moments(*scene_, requests, rays_, workers_, sample, [&](const Moment& moment, const Tile& band) {
      scene_->with_packet_size([&](auto K) { render_band<K.value>(moment, band, sample); });
    });
  }

  /// Blocks are always traced completely, even if the band contains only a part, so that pixels do not depend on the
  /// tile.
  template <int K>
  void render_band(const Moment& moment, const Tile& band, Sample& sample) const {
    constexpr int kSide = RayBlock::kSide, kWidth = RayBlocks::kCellWidth, kHeight = RayBlocks::kCellHeight;
    SeenTriangles seen;
    std::vector<CellView> views(moment.groups.size());
    std::array<Work<K>, kWidth * kHeight / K> batch;
    for (int top = band.y / kHeight * kHeight; top < band.y + band.height; top += kHeight) {
      for (int left = band.x / kWidth * kWidth; left < band.x + band.width; left += kWidth) {
        std::size_t count = 0;
        for (int y = first_block(top, band.y); y < std::min(top + kHeight, band.y + band.height); y += kSide) {
          for (int x = first_block(left, band.x); x < std::min(left + kWidth, band.x + band.width); x += kSide) {
            for (int first = 0; first < RayBlock::kPixels; first += K) {
              Work<K>& work = batch[count++];
              work.x = x, work.y = y;
              work.rays.block = &blocks_.at(x, y), work.rays.first = first;
              work.rays.first_material = mosaic_ ? &first_material_[static_cast<std::size_t>(first)] : nullptr;
            }
            blocks_.at(x, y).prefetch();
          }
        }
        look(moment, blocks_.cell(left, top), seen, views);
        render_batch<K>(moment, views, std::span(batch).first(count), band, sample);
      }
    }
  }

  /// The beginning of the first block of a cell with pixels in a band.
  static int first_block(int cell, int band) { return std::max(cell, band / RayBlock::kSide * RayBlock::kSide); }

  /// Finds the triangles of each group that a cell may see.
  static void look(const Moment& moment, const BearingBounds& cell, SeenTriangles& seen, std::span<CellView> views) {
    seen.shrink(0);
    for (std::size_t i = 0; i < views.size(); ++i) {
      const PlacedGroup& placed = moment.groups[i];
      CellView& view = views[i];
      view.any = placed.bounds.overlap(cell) && placed.triangles().rays.scene() != nullptr;
      if (!view.any) continue;
      const std::size_t first = seen.size();
      view.few = placed.triangles().tree.find(cell, placed.R_group_camera, placed.camera, seen);
      if (!view.few) seen.shrink(first);
      view.triangles = seen.from(first);
    }
  }

  template <int K>
  void render_batch(const Moment& moment, std::span<const CellView> views, std::span<Work<K>> batch, const Tile& band,
                    Sample& sample) const {
    for (Work<K>& work : batch) trace(moment, views, {0, 0}, work.rays);
    for (Work<K>& work : batch) store_geometry(moment, work, band, sample);
    shading_.shade<K>(moment, batch, 1);
    if (places_.size() > 1) smooth_edges<K>(moment, views, batch);
    for (Work<K>& work : batch) store(work, work.rays.irradiance.data(), band, sample.irradiance);
  }

  /// Traces additional rays in the pixels that edges cross.
  template <int K>
  void smooth_edges(const Moment& moment, std::span<const CellView> views, std::span<Work<K>> batch) const {
    std::array<EdgeWork<K>, 8> closer;
    std::size_t count = 0;
    for (Work<K>& work : batch) {
      for (std::uint32_t edges = edges_of(moment, views, work); edges != 0; edges &= edges - 1) {
        const auto lane = static_cast<unsigned>(std::countr_zero(edges));
        work.rays.irradiance[lane] = 0;
        for (std::size_t ray = 0; ray < places_.size(); ray += K) {
          EdgeWork<K>& edge = closer[count++];
          edge.pixel = &work, edge.lane = lane;
          edge.rays.block = &edge.block, edge.rays.first = 0;
          edge.rays.first_material =
              mosaic_ ? first_material_of_edge(work.rays.first + static_cast<int>(lane)) : nullptr;
          spread<K>(*work.rays.block, work.rays.first + static_cast<int>(lane), ray, edge.block);
          if (count < closer.size()) continue;
          look_closer<K>(moment, views, std::span(closer));
          count = 0;
        }
      }
    }
    look_closer<K>(moment, views, std::span(closer).first(count));
  }

  /// The pixels that edges cross, a bit per lane.
  template <int K>
  std::uint32_t edges_of(const Moment& moment, std::span<const CellView> views, const Work<K>& work) const {
    const bool shadows = moment.lighting && moment.lighting->shadows;
    const SeenSurfaces<K> centre{work.rays.packet, work.rays.triangle, work.rays.light};
    Rays<K> corner;
    corner.block = work.rays.block, corner.first = work.rays.first;
    corner.first_material = work.rays.first_material;
    GroupRotations<K> rotations;
    std::uint32_t edges = 0;
    for (const Eigen::Vector2f& place : kCorners) {
      trace(moment, views, area_.side * place, corner);
      corner.light = work.rays.light;
      if (const std::uint32_t lit = corner.hits & work.rays.lit; shadows && lit != 0) {
        if (moment.glossy()) shading_.locate(moment, rotations, 1, corner);
        shading_.light_up(moment, rotations, lit, corner);
      }
      edges |= pixels_on_edges<K>(*moment.triangles, *corner.block, corner.first, centre,
                                  {corner.packet, corner.triangle, corner.light});
    }
    return edges;
  }

  /// Makes a block of K rays in the pixel of lane `lane` of `from`, at the lattice's positions from `first` on.
  template <int K>
  void spread(const RayBlock& from, int lane, std::size_t first, RayBlock& to) const {
    for (std::size_t i = 0; i < K; ++i) {
      const Eigen::Vector2f place = area_.side * places_[first + i];
      to.x[i] = from.x[lane] + from.dx_du[lane] * place.x() + from.dx_dv[lane] * place.y();
      to.y[i] = from.y[lane] + from.dy_du[lane] * place.x() + from.dy_dv[lane] * place.y();
      to.dx_du[i] = from.dx_du[lane], to.dx_dv[i] = from.dx_dv[lane];
      to.dy_du[i] = from.dy_du[lane], to.dy_dv[i] = from.dy_dv[lane];
    }
  }

  template <int K>
  void look_closer(const Moment& moment, std::span<const CellView> views, std::span<EdgeWork<K>> edges) const {
    for (EdgeWork<K>& edge : edges) trace(moment, views, {0, 0}, edge.rays);
    shading_.shade<K>(moment, edges, area_.of_one_of(places_.size()));
    for (EdgeWork<K>& edge : edges) {
      const float sum = std::accumulate(edge.rays.irradiance.begin(), edge.rays.irradiance.end(), 0.0F);
      edge.pixel->rays.irradiance[edge.lane] += sum / static_cast<float>(places_.size());
    }
  }

  template <int K>
  void trace(const Moment& moment, std::span<const CellView> views, const Eigen::Vector2f& place, Rays<K>& rays) const {
    rays.packet.aim(*rays.block, rays.first, place);
    for (unsigned group = 0; group < moment.groups.size(); ++group) {
      const CellView& view = views[group];
      if (!view.any) continue;
      if (view.few) {
        rays.packet.intersect(moment.groups[group], group, view.triangles);
      } else {
        rays.packet.intersect(moment.groups[group], group);
      }
    }
    rays.hits = rays.packet.hits();
    rays.triangle.fill(0);
    if (rays.hits == 0) return;
    for (unsigned i = 0; i < K; ++i) rays.triangle[i] = (rays.hits >> i & 1U) != 0 ? rays.packet.ray.hit.primID[i] : 0;
    if (moment.groups.size() > 1) {
      for (unsigned i = 0; i < K; ++i) rays.triangle[i] += scene_->first_triangle(rays.packet.group(i));
    }
    for (const std::uint32_t triangle : rays.triangle) moment.triangles->prefetch(triangle);
  }

  template <int K>
  static void store_geometry(const Moment& moment, const Work<K>& work, const Tile& band, Sample& sample) {
    const Packet<K>& packet = work.rays.packet;
    store(work, packet.ray.ray.tfar, band, sample.depth);
    if (sample.object.empty()) return;
    std::array<std::uint16_t, K> objects;
    for (unsigned i = 0; i < K; ++i) objects[i] = static_cast<std::uint16_t>(packet.group(i));
    store(work, objects.data(), band, sample.object);
    if (sample.surface.empty()) return;
    std::array<SurfacePoint, K> points;
    for (unsigned i = 0; i < K; ++i) {
      const std::uint32_t first = moment.groups[packet.group(i)].first_triangle;
      points[i] = {work.rays.triangle[i] - first, packet.ray.hit.u[i], packet.ray.hit.v[i]};
    }
    store(work, points.data(), band, sample.surface);
  }

  /// For rays that are all in the pixel `lane` of a block.
  const std::uint32_t* first_material_of_edge(int lane) const {
    return first_material_of_edges_[colour_at(lane % RayBlock::kSide, lane / RayBlock::kSide)].data();
  }

  static constexpr float kHalf = 0.5F;
  inline static const std::array<Eigen::Vector2f, 4> kCorners = {
      Eigen::Vector2f{-kHalf, -kHalf}, Eigen::Vector2f{kHalf, -kHalf}, Eigen::Vector2f{-kHalf, kHalf},
      Eigen::Vector2f{kHalf, kHalf}};

  std::shared_ptr<const RaycastScene> scene_;
  Shading shading_;
  std::vector<Eigen::Vector2f> places_;  // of the rays in a pixel that an edge crosses
  Area area_;
  PixelRays rays_;
  RayBlocks blocks_;
  const Workers& workers_;

  // With colour filters: the first material of each colour, for the pixels of a block and for each colour.
  bool mosaic_;
  std::array<std::uint32_t, RayBlock::kPixels> first_material_;
  PerColour<std::array<std::uint32_t, RayBlock::kPixels>> first_material_of_edges_;
};

}  // namespace

std::unique_ptr<Renderer> make_raycast_renderer(std::shared_ptr<const RaycastScene> scene,
                                                const RaycastOptions& options, const Camera& camera,
                                                const Workers& workers, ColourFilters filters, const PixelArea& area) {
  return std::make_unique<RaycastRenderer>(std::move(scene), options, camera, workers, filters, area);
}

}  // namespace esim::inline backends::inline raycast
