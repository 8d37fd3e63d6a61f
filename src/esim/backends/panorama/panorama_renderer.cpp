#include "esim/backends/panorama/panorama_renderer.h"

#include <algorithm>
#include <limits>

#include "esim/render/bands.h"
#include "esim/scene/images/equirectangular.h"

namespace esim::inline backends::inline panorama {
namespace {

constexpr int kLanes = 16;

class PanoramaRenderer final : public ProcessorRenderer {
 public:
  PanoramaRenderer(Panorama panorama, const Camera& camera, const Workers& workers, bool mosaic, double footprint)
      : panorama_(std::move(panorama)), rays_(camera, footprint), workers_(workers), mosaic_(mosaic) {}

  RendererTraits traits() const override {
    return {.name = "panorama", .granularity = Granularity::tile, .at_infinity = true, .has_edges = false};
  }

 private:
  void compute(std::span<const RenderRequest> requests, Sample& sample) const override {
    std::vector<Eigen::Matrix3f> R_panorama_camera;
    for (const RenderRequest& request : requests) {
      const Eigen::Quaterniond rotation = panorama_.R_world_panorama.conjugate() * request.camera.T_world_body.rotation;
      R_panorama_camera.emplace_back(rotation.toRotationMatrix().cast<float>());
    }
    render_in_bands(requests, rays_, workers_, sample, [&](std::size_t which, const Tile& band) {
      for (int y = band.y; y < band.y + band.height; ++y) {
        for (int x = band.x; x < band.x + band.width; x += kLanes) {
          shade(R_panorama_camera[which], x, y, std::min(kLanes, band.x + band.width - x), sample);
        }
      }
    });
  }

  void shade(const Eigen::Matrix3f& R, int first, int row, int count, Sample& sample) const {
    const RayLanes<kLanes> rays(rays_, first, row, count);
    const TextureLookup<kLanes> at = on_equirectangular<kLanes>(R, rays);
    const auto radiance = mosaic_ ? sample_mosaic(panorama_.colours, first, row, at) : panorama_.radiance->sample(at);
    std::copy_n(radiance.begin(), count, sample.irradiance.row(row) + first);
    std::fill_n(sample.depth.row(row) + first, count, std::numeric_limits<float>::infinity());
  }

  Panorama panorama_;
  PixelRays rays_;
  const Workers& workers_;
  bool mosaic_;
};

}  // namespace

std::unique_ptr<Renderer> make_panorama_renderer(Panorama panorama, const Camera& camera, const Workers& workers,
                                                 ColourFilters filters, double footprint) {
  const bool mosaic = filters == ColourFilters::rggb && panorama.colours[0] != nullptr;
  return std::make_unique<PanoramaRenderer>(std::move(panorama), camera, workers, mosaic, footprint);
}

}  // namespace esim::inline backends::inline panorama
