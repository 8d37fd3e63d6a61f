#include "esim/backends/raycast/raster/raster_renderer.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "esim/backends/raycast/raster/fragment_shading.h"
#include "esim/render/bands.h"

namespace esim::inline backends::inline raycast {
namespace {

class RasterRenderer final : public ProcessorRenderer {
 public:
  RasterRenderer(std::shared_ptr<const RaycastScene> scene, const RasterOptions& options, const Camera& camera,
                 const Workers& workers, ColourFilters filters, const PixelArea& area)
      : scene_(std::move(scene)),
        background_(options.background),
        samples_(options.samples_per_pixel),
        side_(static_cast<float>(area.edges) / static_cast<float>(area.texture)),
        rays_(camera, area.texture),
        cells_(rays_, side_),
        workers_(workers),
        mosaic_(filters == ColourFilters::rggb && scene_->has_colours()) {}

  RendererTraits traits() const override {
    return {.name = "mesh",
            .granularity = Granularity::tile,
            .at_infinity = false,
            .engine = "raster",
            .deforms = scene_->deforms()};
  }

 private:
  void compute(std::span<const RenderRequest> requests, Sample& sample) const override {
    render_moments(*scene_, requests, rays_, workers_, sample, [&](const Moment& moment, const Tile& band) {
      scene_->with_packet_size([&](auto K) { render_band<K.value>(moment, band, sample); });
    });
  }

  /// What is behind the surfaces of a cell: the background, or the sky, which is looked up for K pixels at a time.
  template <int K>
  class Backdrop {
   public:
    Backdrop(const RasterRenderer& renderer, const Moment& moment, const ImageCell& cell)
        : renderer_(renderer), moment_(moment), cell_(cell) {}

    float at(int pixel) {
      if (!moment_.sky) return renderer_.background_;
      if (const int first = pixel / K * K; first != first_) look_up(first);
      return radiance_[static_cast<std::size_t>(pixel % K)];
    }

   private:
    void look_up(int first) {
      first_ = first;
      SkyRays<K> rays;
      const float per_side = 1 / renderer_.side_;
      std::array<std::uint32_t, K> first_material;
      for (std::size_t i = 0; i < K; ++i) {
        const std::size_t k = static_cast<std::size_t>(first) + i;
        rays.x[i] = cell_.x[k], rays.y[i] = cell_.y[k];
        rays.dx_du[i] = per_side * cell_.dx_du[k], rays.dx_dv[i] = per_side * cell_.dx_dv[k];
        rays.dy_du[i] = per_side * cell_.dy_du[k], rays.dy_dv[i] = per_side * cell_.dy_dv[k];
        const int column = static_cast<int>(k) % ImageCell::kWidth, row = static_cast<int>(k) / ImageCell::kWidth;
        first_material[i] = renderer_.scene_->first_material(colour_at(column, row));
      }
      const Shading shading(*renderer_.scene_, 0);
      radiance_ = moment_.sky->template radiance<K>(
          rays, shading.views_of<K>(renderer_.mosaic_ ? first_material.data() : nullptr));
    }

    const RasterRenderer& renderer_;
    const Moment& moment_;
    const ImageCell& cell_;
    int first_ = -1;
    std::array<float, K> radiance_{};
  };

  template <int K>
  void render_band(const Moment& moment, const Tile& band, Sample& sample) const {
    constexpr int kWidth = ImageCell::kWidth, kHeight = ImageCell::kHeight;
    CellSurfaces surfaces;
    const bool shadows = moment.lighting && moment.lighting->shadows;
    Coverage coverage(samples_, *moment.triangles, shadows);
    FragmentShading<K> shading(*scene_, moment, side_, samples_.shadows);
    std::vector<Fragment> fragments;
    for (int top = band.y / kHeight * kHeight; top < band.y + band.height; top += kHeight) {
      for (int left = band.x / kWidth * kWidth; left < band.x + band.width; left += kWidth) {
        const ImageCell& cell = cells_.at(left, top);
        const CellPart part{{std::max(band.x - left, 0), std::min(band.x + band.width - left, kWidth) - 1},
                            {std::max(band.y - top, 0), std::min(band.y + band.height - top, kHeight) - 1}};
        surfaces.collect(moment.groups, cell, part);
        coverage.begin(surfaces, cell);
        fragments.clear();
        for (int row = part.rows.first; row <= part.rows.last; ++row) {
          for (int column = part.columns.first; column <= part.columns.last; ++column) {
            const SeenInMiddle seen = coverage.divide(row * kWidth + column, fragments);
            sample.depth(left + column, top + row) = seen.inverse_depth > 0 ? 1 / seen.inverse_depth : kInfinity;
            if (!sample.object.empty())
              sample.object(left + column, top + row) = static_cast<std::uint16_t>(seen.group);
            if (!sample.surface.empty() && moment.groups[seen.group].deforming != nullptr)
              sample.surface(left + column, top + row) = point_in_middle(moment, surfaces, cell, seen, row, column);
          }
        }
        shading.shade(surfaces, cell, fragments, mosaic_);
        add_up(shading, fragments, Backdrop<K>(*this, moment, cell), left, top, part, sample.irradiance);
      }
    }
  }

  /// The point of a deforming object that is seen in the middle of a pixel.
  static SurfacePoint point_in_middle(const Moment& moment, const CellSurfaces& surfaces, const ImageCell& cell,
                                      const SeenInMiddle& seen, int row, int column) {
    const auto pixel = static_cast<std::size_t>(row * ImageCell::kWidth + column);
    const ScreenTriangle& triangle = surfaces.triangle(seen.triangle);
    const auto [b1, b2] = triangle.barycentric(cell.x[pixel], cell.y[pixel]);
    return {triangle.index - moment.groups[seen.group].first_triangle, b1, b2};
  }

  /// Sums the fragments of each pixel, which are adjacent; the background fills what they leave.
  template <int K>
  void add_up(const FragmentShading<K>& shading, std::span<const Fragment> fragments, Backdrop<K> backdrop, int left,
              int top, const CellPart& part, Image<float>& irradiance) const {
    std::size_t next = 0;
    for (int row = part.rows.first; row <= part.rows.last; ++row) {
      for (int column = part.columns.first; column <= part.columns.last; ++column) {
        const int pixel = row * ImageCell::kWidth + column;
        float sum = 0, area = 0;
        for (; next < fragments.size() && fragments[next].pixel == pixel; ++next)
          sum += fragments[next].area * shading.irradiance(next), area += fragments[next].area;
        irradiance(left + column, top + row) =
            area > 1 - kSmallestArea ? sum / area : sum + (1 - area) * backdrop.at(pixel);
      }
    }
  }

  std::shared_ptr<const RaycastScene> scene_;
  float background_;
  CoverageSamples samples_;
  float side_;  // of the square that edges are averaged over, in footprints
  PixelRays rays_;
  ImageCells cells_;
  const Workers& workers_;
  bool mosaic_;
};

}  // namespace

std::shared_ptr<const RaycastScene> build_raster_scene(const Scene& scene) {
  return std::make_shared<const RaycastScene>(scene, SceneUse::surfaces);
}

std::unique_ptr<Renderer> make_raster_renderer(std::shared_ptr<const RaycastScene> scene, const RasterOptions& options,
                                               const Camera& camera, const Workers& workers, ColourFilters filters,
                                               const PixelArea& area) {
  return std::make_unique<RasterRenderer>(std::move(scene), options, camera, workers, filters, area);
}

}  // namespace esim::inline backends::inline raycast
