#include "esim/backends/panorama/panorama_renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "esim/core/fast_arc_tangent.h"
#include "esim/render/bands.h"

namespace esim::inline backends::inline panorama {
namespace {

constexpr int kLanes = 16;
constexpr float kPi = std::numbers::pi_v<float>;

/// Arc tangent of y/x on (-pi, pi], within 3e-7.
inline float arc_tangent(float y, float x) {
  const float abs_x = std::fabs(x), abs_y = std::fabs(y);
  float angle = fast_arc_tangent(std::min(abs_x, abs_y) / std::max(std::max(abs_x, abs_y), 1e-30F));
  angle = abs_y > abs_x ? kPi / 2 - angle : angle;
  angle = x < 0 ? kPi - angle : angle;
  return std::copysign(angle, y);
}

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
    TextureLookup<kLanes> at;
    const float r00 = R(0, 0), r01 = R(0, 1), r02 = R(0, 2);
    const float r10 = R(1, 0), r11 = R(1, 1), r12 = R(1, 2);
    const float r20 = R(2, 0), r21 = R(2, 1), r22 = R(2, 2);
    constexpr float kPerLongitude = -1 / (2 * kPi), kPerLatitude = -1 / kPi;
#pragma omp simd
    for (int i = 0; i < kLanes; ++i) {
      const float bx = rays.x[i], by = rays.y[i];
      const float dx = r00 * bx + r01 * by + r02, dy = r10 * bx + r11 * by + r12, dz = r20 * bx + r21 * by + r22;
      const float rho2 = std::max(dx * dx + dy * dy, 1e-12F);
      const float rho = std::sqrt(rho2);
      at.u[i] = 0.5F + kPerLongitude * arc_tangent(dy, dx);
      at.v[i] = 0.5F + kPerLatitude * arc_tangent(dz, rho);

      // Derivatives of u and v with respect to d, then with respect to the pixel to the right and downwards.
      const float u_x = -kPerLongitude * dy / rho2, u_y = kPerLongitude * dx / rho2;
      const float scale = kPerLatitude / (rho2 + dz * dz);
      const float v_x = -dz * dx / rho * scale, v_y = -dz * dy / rho * scale, v_z = rho * scale;
      const float right_x = r00 * rays.dx_du[i] + r01 * rays.dy_du[i],
                  down_x = r00 * rays.dx_dv[i] + r01 * rays.dy_dv[i];
      const float right_y = r10 * rays.dx_du[i] + r11 * rays.dy_du[i],
                  down_y = r10 * rays.dx_dv[i] + r11 * rays.dy_dv[i];
      const float right_z = r20 * rays.dx_du[i] + r21 * rays.dy_du[i],
                  down_z = r20 * rays.dx_dv[i] + r21 * rays.dy_dv[i];
      at.du_dx[i] = u_x * right_x + u_y * right_y;
      at.dv_dx[i] = v_x * right_x + v_y * right_y + v_z * right_z;
      at.du_dy[i] = u_x * down_x + u_y * down_y;
      at.dv_dy[i] = v_x * down_x + v_y * down_y + v_z * down_z;
    }
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
