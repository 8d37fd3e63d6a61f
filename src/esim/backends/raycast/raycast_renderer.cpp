#include "esim/backends/raycast/raycast_renderer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <type_traits>

#include "esim/backends/raycast/raycast_scene.h"
#include "esim/core/error.h"
#include "esim/render/bands.h"

namespace esim {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// A block of K pixels traced as one packet.
template <int K>
struct Packet {
  static constexpr int kWidth = K == 4 ? 2 : 4;
  static constexpr int kHeight = K / kWidth;
  using RayHit = std::conditional_t<K == 16, RTCRayHit16, std::conditional_t<K == 8, RTCRayHit8, RTCRayHit4>>;

  alignas(64) std::array<int, K> valid;  // -1: the lane is a pixel of the tile
  RayLanes<K> pixels;
  alignas(64) std::array<float, K> radiance;
  RayHit ray;

  void intersect(RTCScene scene, RTCIntersectContext& context) {
    if constexpr (K == 16) rtcIntersect16(valid.data(), scene, &context, &ray);
    if constexpr (K == 8) rtcIntersect8(valid.data(), scene, &context, &ray);
    if constexpr (K == 4) rtcIntersect4(valid.data(), scene, &context, &ray);
  }
};

/// Places of the rays in a pixel: a rank-1 lattice around its centre, which comes first.
std::vector<Eigen::Vector2f> ray_offsets(int count) {
  const int generator = count == 13 ? 5 : 2;
  std::vector<Eigen::Vector2f> offsets;
  for (int i = 0; i < count; ++i) {
    const auto centred = [count](int k) {
      return static_cast<float>(k > count / 2 ? k - count : k) / static_cast<float>(count);
    };
    offsets.emplace_back(centred(i), centred((generator * i) % count));
  }
  return offsets;
}

class RaycastRenderer final : public Renderer {
 public:
  RaycastRenderer(std::shared_ptr<const RaycastScene> scene, const RaycastOptions& options, const Camera& camera,
                  const Workers& workers)
      : scene_(std::move(scene)),
        background_(options.background),
        offsets_(ray_offsets(options.samples_per_pixel)),
        footprint_(1.0F / std::sqrt(static_cast<float>(options.samples_per_pixel))),
        rays_(camera),
        workers_(workers) {}

  RendererTraits traits() const override {
    return {.name = "mesh", .granularity = Granularity::tile, .at_infinity = false};
  }

  void render(const RenderRequest& request, Sample& sample) override {
    const View view{request.camera.T_world_body.rotation.toRotationMatrix().cast<float>(),
                    request.camera.T_world_body.translation.cast<float>()};
    render_in_bands(request, rays_, workers_, sample, [&](const Tile& band) {
      switch (scene_->packet_size()) {
        case 16:
          return render_band<16>(view, band, sample);
        case 8:
          return render_band<8>(view, band, sample);
        default:
          return render_band<4>(view, band, sample);
      }
    });
  }

 private:
  struct View {
    Eigen::Matrix3f R_world_camera;
    Eigen::Vector3f origin;
  };

  template <int K>
  void render_band(const View& view, const Tile& band, Sample& sample) const {
    Packet<K> packet;
    std::array<float, K> sum;
    const float mean = 1.0F / static_cast<float>(offsets_.size());
    for (int y = band.y; y < band.y + band.height; y += Packet<K>::kHeight) {
      for (int x = band.x; x < band.x + band.width; x += Packet<K>::kWidth) {
        load_pixels(packet, band, x, y);
        sum.fill(0);
        for (std::size_t i = 0; i < offsets_.size(); ++i) {
          trace(packet, view, offsets_[i]);
          shade(packet, view);
          for (unsigned lane = 0; lane < K; ++lane) sum[lane] += packet.radiance[lane];
          if (i == 0) store<K>(band, x, y, sample.depth, [&](unsigned lane) { return packet.ray.ray.tfar[lane]; });
        }
        store<K>(band, x, y, sample.irradiance, [&](unsigned lane) { return sum[lane] * mean; });
      }
    }
  }

  /// Takes the block of pixels at (x, y); what lies outside of the band repeats a pixel of it.
  template <int K>
  void load_pixels(Packet<K>& packet, const Tile& band, int x, int y) const {
    constexpr int kWidth = Packet<K>::kWidth;
    const int columns = std::min(kWidth, band.x + band.width - x),
              rows = std::min(Packet<K>::kHeight, band.y + band.height - y);
    for (int row = 0; row < Packet<K>::kHeight; ++row) {
      const int lane = row * kWidth, source = y + std::min(row, rows - 1);
      if (columns == kWidth) {
        packet.pixels.template load<kWidth>(rays_, x, source, lane);
      } else {
        packet.pixels.load(rays_, x, source, lane, columns, kWidth);
      }
      for (int column = 0; column < kWidth; ++column) {
        packet.valid[static_cast<unsigned>(lane + column)] = row < rows && column < columns ? -1 : 0;
      }
    }
  }

  /// Casts one ray per pixel. Bearings have z = 1 in the camera, so that the ray's parameter is the planar depth.
  template <int K>
  void trace(Packet<K>& packet, const View& view, const Eigen::Vector2f& offset) const {
    const Eigen::Matrix3f& R = view.R_world_camera;
    const float r00 = R(0, 0), r01 = R(0, 1), r02 = R(0, 2);
    const float r10 = R(1, 0), r11 = R(1, 1), r12 = R(1, 2);
    const float r20 = R(2, 0), r21 = R(2, 1), r22 = R(2, 2);
    const float ox = view.origin.x(), oy = view.origin.y(), oz = view.origin.z();
    const float sx = offset.x(), sy = offset.y();
    const RayLanes<K>& pixels = packet.pixels;
    auto& ray = packet.ray.ray;
    auto& hit = packet.ray.hit;
#pragma omp simd
    for (int i = 0; i < K; ++i) {
      const float bx = pixels.x[i] + pixels.dx_du[i] * sx + pixels.dx_dv[i] * sy;
      const float by = pixels.y[i] + pixels.dy_du[i] * sx + pixels.dy_dv[i] * sy;
      ray.dir_x[i] = r00 * bx + r01 * by + r02;
      ray.dir_y[i] = r10 * bx + r11 * by + r12;
      ray.dir_z[i] = r20 * bx + r21 * by + r22;
      ray.org_x[i] = ox;
      ray.org_y[i] = oy;
      ray.org_z[i] = oz;
      ray.tnear[i] = 0;
      ray.tfar[i] = kInfinity;
      ray.time[i] = 0;
      ray.mask[i] = ~0U;
      ray.id[i] = 0;
      ray.flags[i] = 0;
      hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
      hit.primID[i] = RTC_INVALID_GEOMETRY_ID;
    }
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    packet.intersect(scene_->scene(), context);
  }

  /// Radiance of what the packet's rays have hit, material by material.
  template <int K>
  void shade(Packet<K>& packet, const View& view) const {
    packet.radiance.fill(background_);
    std::uint32_t todo = 0;
    for (unsigned i = 0; i < K; ++i) todo |= (packet.ray.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID ? 1U : 0U) << i;
    if (todo == 0) return;

    HitTriangles<K> triangles;
    gather_triangles<K>(packet, todo, triangles);
    TextureLookup<K> at;
    locate_on_textures<K>(packet, view, triangles, at);
    while (todo != 0) {
      const std::uint32_t current = triangles.material[static_cast<std::size_t>(std::countr_zero(todo))];
      const Material& surface = scene_->material(current);
      std::array<float, K> radiance;
      if (surface.texture != nullptr) {
        radiance = surface.texture->template sample<K>(at);
      } else {
        radiance.fill(surface.base);
      }
      for (unsigned i = 0; i < K; ++i) {
        if ((todo >> i & 1U) == 0 || triangles.material[i] != current) continue;
        packet.radiance[i] = radiance[i];
        todo &= ~(1U << i);
      }
    }
  }

  /// What the triangles that the packet's rays have hit need for shading; zero where a ray has hit nothing.
  template <int K>
  struct HitTriangles {
    alignas(64) std::array<float, K> u0, v0, u1, v1, u2, v2;
    alignas(64) std::array<float, K> ux, uy, uz, vx, vy, vz;  // gradients of the texture coordinates, 1/m
    std::array<std::uint32_t, K> material;
  };

  template <int K>
  void gather_triangles(const Packet<K>& packet, std::uint32_t hits, HitTriangles<K>& out) const {
    static constexpr TriangleShading kNone{};
    const auto& ids = packet.ray.hit.primID;
    const std::uint32_t first = ids[std::countr_zero(hits)];
    if (std::all_of(ids, ids + K, [first](std::uint32_t id) { return id == first; })) {
      for (unsigned i = 0; i < K; ++i)
        put(scene_->triangle(first), i, out);  // one triangle, as in most packets: a broadcast
      return;
    }
    for (unsigned i = 0; i < K; ++i) put((hits >> i & 1U) != 0 ? scene_->triangle(ids[i]) : kNone, i, out);
  }

  template <int K>
  static void put(const TriangleShading& triangle, unsigned lane, HitTriangles<K>& out) {
    out.u0[lane] = triangle.u0, out.v0[lane] = triangle.v0, out.u1[lane] = triangle.u1;
    out.v1[lane] = triangle.v1, out.u2[lane] = triangle.u2, out.v2[lane] = triangle.v2;
    out.ux[lane] = triangle.gradient_u[0], out.uy[lane] = triangle.gradient_u[1], out.uz[lane] = triangle.gradient_u[2];
    out.vx[lane] = triangle.gradient_v[0], out.vy[lane] = triangle.gradient_v[1], out.vz[lane] = triangle.gradient_v[2];
    out.material[lane] = triangle.material;
  }

  /// Texture coordinates and footprints. As the bearing moves by e, the point on a plane of normal n seen along d
  /// moves by Z (e - d (n.e)/(n.d)).
  template <int K>
  void locate_on_textures(const Packet<K>& packet, const View& view, const HitTriangles<K>& on,
                          TextureLookup<K>& at) const {
    const Eigen::Matrix3f& R = view.R_world_camera;
    const float r00 = R(0, 0), r01 = R(0, 1), r10 = R(1, 0), r11 = R(1, 1), r20 = R(2, 0), r21 = R(2, 1);
    const RayLanes<K>& pixels = packet.pixels;
    const auto& ray = packet.ray.ray;
    const auto& hit = packet.ray.hit;
    const float footprint = footprint_;
#pragma omp simd
    for (unsigned i = 0; i < K; ++i) {
      // Lanes that have hit nothing hold numbers of no meaning: they stay at the texture's origin.
      const float depth = ray.tfar[i] < kInfinity ? ray.tfar[i] : 0.0F;
      const float b1 = depth > 0 ? hit.u[i] : 0.0F, b2 = depth > 0 ? hit.v[i] : 0.0F;
      at.u[i] = on.u0[i] + b1 * on.u1[i] + b2 * on.u2[i];
      at.v[i] = on.v0[i] + b1 * on.v1[i] + b2 * on.v2[i];

      const float dx = ray.dir_x[i], dy = ray.dir_y[i], dz = ray.dir_z[i];
      const float nx = depth > 0 ? hit.Ng_x[i] : 0.0F, ny = depth > 0 ? hit.Ng_y[i] : 0.0F,
                  nz = depth > 0 ? hit.Ng_z[i] : 0.0F;
      const float facing = nx * dx + ny * dy + nz * dz;
      const float per_facing = std::fabs(facing) > 1e-20F ? 1.0F / facing : 0.0F;
      const float u_d = (on.ux[i] * dx + on.uy[i] * dy + on.uz[i] * dz) * per_facing;
      const float v_d = (on.vx[i] * dx + on.vy[i] * dy + on.vz[i] * dz) * per_facing;
      const float scale = depth * footprint;
      const float u_x = scale * (on.ux[i] - u_d * nx), u_y = scale * (on.uy[i] - u_d * ny),
                  u_z = scale * (on.uz[i] - u_d * nz);
      const float v_x = scale * (on.vx[i] - v_d * nx), v_y = scale * (on.vy[i] - v_d * ny),
                  v_z = scale * (on.vz[i] - v_d * nz);

      // Along the camera's x and y axes, then as the pixel moves by one to the right and by one downwards.
      const float u_bx = u_x * r00 + u_y * r10 + u_z * r20, u_by = u_x * r01 + u_y * r11 + u_z * r21;
      const float v_bx = v_x * r00 + v_y * r10 + v_z * r20, v_by = v_x * r01 + v_y * r11 + v_z * r21;
      at.du_dx[i] = u_bx * pixels.dx_du[i] + u_by * pixels.dy_du[i];
      at.dv_dx[i] = v_bx * pixels.dx_du[i] + v_by * pixels.dy_du[i];
      at.du_dy[i] = u_bx * pixels.dx_dv[i] + u_by * pixels.dy_dv[i];
      at.dv_dy[i] = v_bx * pixels.dx_dv[i] + v_by * pixels.dy_dv[i];
    }
  }

  /// Writes the packet's block of pixels, value by lane.
  template <int K, typename Value>
  static void store(const Tile& band, int x, int y, Image<float>& image, const Value& value) {
    constexpr int kWidth = Packet<K>::kWidth;
    const int columns = std::min(kWidth, band.x + band.width - x),
              rows = std::min(Packet<K>::kHeight, band.y + band.height - y);
    for (int row = 0; row < rows; ++row) {
      float* const out = image.row(y + row) + x;
      for (int column = 0; column < columns; ++column)
        out[column] = value(static_cast<unsigned>(row * kWidth + column));
    }
  }

  std::shared_ptr<const RaycastScene> scene_;
  float background_;
  std::vector<Eigen::Vector2f> offsets_;
  float footprint_;  // of one ray, in pixels
  PixelRays rays_;
  const Workers& workers_;
};

}  // namespace

std::unique_ptr<Renderer> make_raycast_renderer(std::shared_ptr<const RaycastScene> scene,
                                                const RaycastOptions& options, const Camera& camera,
                                                const Workers& workers) {
  const int n = options.samples_per_pixel;
  if (n != 1 && n != 5 && n != 13) {
    throw UserError("samples_per_pixel: " + std::to_string(n) + " is not supported; use 1, 5 or 13");
  }
  return std::make_unique<RaycastRenderer>(std::move(scene), options, camera, workers);
}

}  // namespace esim
