#include "esim/backends/plane/plane_renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "esim/render/bands.h"

namespace esim::inline backends::inline plane {
namespace {

constexpr int kLanes = 16;

class PlaneRenderer final : public ProcessorRenderer {
 public:
  PlaneRenderer(TexturedPlane plane, const Camera& camera, const Workers& workers, bool mosaic, double footprint)
      : plane_(std::move(plane)), rays_(camera, footprint), workers_(workers), mosaic_(mosaic) {}

  RendererTraits traits() const override {
    return {.name = "plane", .granularity = Granularity::tile, .at_infinity = false, .has_edges = false};
  }

 private:
  void compute(std::span<const RenderRequest> requests, Sample& sample) const override {
    std::vector<View> views;
    for (const RenderRequest& request : requests) {
      const SE3 T_plane_camera = plane_.T_world_plane.inverse() * request.camera.T_world_body;
      views.push_back(
          {T_plane_camera.rotation.toRotationMatrix().cast<float>(), T_plane_camera.translation.cast<float>()});
    }
    render_in_bands(requests, rays_, workers_, sample, [&](std::size_t which, const Tile& band) {
      for (int y = band.y; y < band.y + band.height; ++y) {
        for (int x = band.x; x < band.x + band.width; x += kLanes) {
          shade(views[which], x, y, std::min(kLanes, band.x + band.width - x), sample);
        }
      }
    });
  }

  struct View {
    Eigen::Matrix3f R_plane_camera;
    Eigen::Vector3f origin;  // of the camera, in the plane's frame
  };

  void shade(const View& view, int first, int row, int count, Sample& sample) const {
    const RayLanes<kLanes> rays(rays_, first, row, count);
    TextureLookup<kLanes> at;
    alignas(64) std::array<float, kLanes> depth;
    const Eigen::Matrix3f& R = view.R_plane_camera;
    const float r00 = R(0, 0), r01 = R(0, 1), r02 = R(0, 2);
    const float r10 = R(1, 0), r11 = R(1, 1), r12 = R(1, 2);
    const float r20 = R(2, 0), r21 = R(2, 1), r22 = R(2, 2);
    const float ox = view.origin.x(), oy = view.origin.y(), oz = view.origin.z();
    const float per_width = 1.0F / static_cast<float>(plane_.width_m);
    const float per_height =
        per_width * static_cast<float>(plane_.radiance->width()) / static_cast<float>(plane_.radiance->height());
    // The edge of the plane, in texture coordinates around its centre.
    const float reach = plane_.endless ? 1e6F : 0.5F;
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
#pragma omp simd
    for (int i = 0; i < kLanes; ++i) {
      const float bx = rays.x[i], by = rays.y[i];
      const float dx = r00 * bx + r01 * by + r02, dy = r10 * bx + r11 * by + r12, dz = r20 * bx + r21 * by + r22;
      const float slope = std::fabs(dz) > 1e-12F ? 1.0F / dz : 1e12F;

      // The bearing has z = 1 in the camera frame, so the ray's parameter is the planar depth.
      const float distance = -oz * slope;
      const float u = (ox + distance * dx) * per_width, v = (oy + distance * dy) * per_height;
      const float seen = std::max(std::fabs(u), std::fabs(v)) <= reach ? distance : -1.0F;  // -1: no hit
      depth[i] = seen > 0 ? seen : kInfinity;
      at.u[i] = seen > 0 ? u + 0.5F : 0.0F;
      at.v[i] = seen > 0 ? v + 0.5F : 0.0F;

      // As the bearing moves by e, the point on the plane moves by distance * (e - d e_z / d_z).
      const float right_x = r00 * rays.dx_du[i] + r01 * rays.dy_du[i],
                  down_x = r00 * rays.dx_dv[i] + r01 * rays.dy_dv[i];
      const float right_y = r10 * rays.dx_du[i] + r11 * rays.dy_du[i],
                  down_y = r10 * rays.dx_dv[i] + r11 * rays.dy_dv[i];
      const float right_along = (r20 * rays.dx_du[i] + r21 * rays.dy_du[i]) * slope;
      const float down_along = (r20 * rays.dx_dv[i] + r21 * rays.dy_dv[i]) * slope;
      const float footprint = seen > 0 ? seen : 0.0F;
      const float per_u = footprint * per_width, per_v = footprint * per_height;
      at.du_dx[i] = per_u * (right_x - dx * right_along);
      at.dv_dx[i] = per_v * (right_y - dy * right_along);
      at.du_dy[i] = per_u * (down_x - dx * down_along);
      at.dv_dy[i] = per_v * (down_y - dy * down_along);
    }
    const auto radiance = mosaic_ ? sample_mosaic(plane_.colours, first, row, at) : plane_.radiance->sample(at);
    float* const irradiance = sample.irradiance.row(row) + first;
    for (int i = 0; i < count; ++i) {
      const auto lane = static_cast<unsigned>(i);
      irradiance[i] = depth[lane] < kInfinity ? radiance[lane] : plane_.background;
    }
    std::copy_n(depth.begin(), count, sample.depth.row(row) + first);
  }

  TexturedPlane plane_;
  PixelRays rays_;
  const Workers& workers_;
  bool mosaic_;
};

}  // namespace

std::unique_ptr<Renderer> make_plane_renderer(TexturedPlane plane, const Camera& camera, const Workers& workers,
                                              ColourFilters filters, double footprint) {
  const bool mosaic = filters == ColourFilters::rggb && plane.colours[0] != nullptr;
  return std::make_unique<PlaneRenderer>(std::move(plane), camera, workers, mosaic, footprint);
}

}  // namespace esim::inline backends::inline plane
