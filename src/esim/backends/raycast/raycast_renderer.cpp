#include "esim/backends/raycast/raycast_renderer.h"

#include <algorithm>
#include <bit>
#include <span>
#include <string>

#include "esim/backends/raycast/lights.h"
#include "esim/core/error.h"
#include "esim/render/bands.h"

namespace esim {
namespace {

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

/// The scene at one time, seen from one pose.
struct Moment {
  std::vector<PlacedGroup> groups;
  std::optional<Lighting> lighting;  // in the camera frame
};

/// K pixels on their way through the stages of rendering.
template <int K>
struct Work {
  const RayBlock* block;
  const BearingBounds* bounds;
  int x, y, first;  // the block's corner, and the first of its lanes
  Packet<K> packet;
  std::uint32_t hits;                                 // a bit per lane
  alignas(64) std::array<std::uint32_t, K> triangle;  // among all of the scene; any where nothing is hit
  TextureLookup<K> at;
  alignas(64) std::array<std::uint32_t, K> material;
  alignas(64) std::array<float, K> sum;
};

/// Writes the values of those of the K pixels that lie in the tile.
template <int K, typename T>
void store(const Work<K>& work, const T* values, const Tile& tile, Image<T>& image) {
  constexpr int kSide = RayBlock::kSide;
  const int top = work.y + work.first / kSide;
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
                  const Workers& workers)
      : scene_(std::move(scene)),
        background_(options.background),
        offsets_(ray_offsets(options.samples_per_pixel)),
        footprint_(1.0F / std::sqrt(static_cast<float>(options.samples_per_pixel))),
        rays_(camera),
        blocks_(rays_),
        workers_(workers) {}

  RendererTraits traits() const override {
    return {.name = "mesh", .granularity = Granularity::tile, .at_infinity = false, .wide_pixels = true};
  }

 private:
  void compute(const RenderRequest& request, Sample& sample) const override {
    Moment moment{scene_->place(request), scene_->lighting()};
    if (moment.lighting) moment.lighting = in_camera_frame(*moment.lighting, moment.groups[0]);
    render_in_bands(request, rays_, workers_, sample, [&](const Tile& band) {
      switch (scene_->packet_size()) {
        case 16:
          return render_band<16>(moment, band, sample);
        case 8:
          return render_band<8>(moment, band, sample);
        default:
          return render_band<4>(moment, band, sample);
      }
    });
  }

  /// Blocks are traced in whole even if the band takes only a part of them, so that pixels do not depend on the tile.
  template <int K>
  void render_band(const Moment& moment, const Tile& band, Sample& sample) const {
    constexpr int kSide = RayBlock::kSide, kBatch = 8 * 16 / K;
    std::array<Work<K>, kBatch> batch;
    std::size_t count = 0;
    for (int y = band.y / kSide * kSide; y < band.y + band.height; y += kSide) {
      for (int x = band.x / kSide * kSide; x < band.x + band.width; x += kSide) {
        for (int first = 0; first < RayBlock::kPixels; first += K) {
          Work<K>& work = batch[count++];
          work.block = &blocks_.at(x, y);
          work.bounds = &blocks_.bounds(x, y);
          work.x = x, work.y = y, work.first = first;
          if (count < batch.size()) continue;
          render_batch<K>(moment, std::span(batch), band, sample);
          count = 0;
        }
      }
    }
    render_batch<K>(moment, std::span(batch).first(count), band, sample);
  }

  /// Stage by stage, so that what a stage waits for in memory comes while others are in the one before.
  template <int K>
  void render_batch(const Moment& moment, std::span<Work<K>> batch, const Tile& band, Sample& sample) const {
    for (Work<K>& work : batch) work.sum.fill(0);
    for (std::size_t i = 0; i < offsets_.size(); ++i) {
      for (Work<K>& work : batch) trace(moment, offsets_[i], work);
      if (i == 0) {
        for (Work<K>& work : batch) store_geometry(work, band, sample);
      }
      GroupRotations<K> rotations;
      for (Work<K>& work : batch) locate(moment, rotations, work);
      for (Work<K>& work : batch) shade(moment, rotations, work);
    }
    const float mean = 1.0F / static_cast<float>(offsets_.size());
    for (Work<K>& work : batch) {
      for (float& irradiance : work.sum) irradiance *= mean;
      store(work, work.sum.data(), band, sample.irradiance);
    }
  }

  template <int K>
  void trace(const Moment& moment, const Eigen::Vector2f& offset, Work<K>& work) const {
    work.packet.aim(*work.block, work.first, offset);
    for (unsigned group = 0; group < moment.groups.size(); ++group) {
      const PlacedGroup& placed = moment.groups[group];
      if (placed.triangles != nullptr && placed.bounds.overlap(*work.bounds)) work.packet.intersect(placed, group);
    }
    work.hits = work.packet.hits();
    if (work.hits == 0) return;
    for (unsigned i = 0; i < K; ++i) work.triangle[i] = (work.hits >> i & 1U) != 0 ? work.packet.ray.hit.primID[i] : 0;
    if (moment.groups.size() > 1) {
      for (unsigned i = 0; i < K; ++i) work.triangle[i] += scene_->first_triangle(work.packet.group(i));
    }
    for (const std::uint32_t triangle : work.triangle) __builtin_prefetch(&scene_->triangle(triangle));
  }

  template <int K>
  static void store_geometry(const Work<K>& work, const Tile& band, Sample& sample) {
    store(work, work.packet.ray.ray.tfar, band, sample.depth);
    if (sample.object.empty()) return;
    std::array<std::uint16_t, K> objects;
    for (unsigned i = 0; i < K; ++i) objects[i] = static_cast<std::uint16_t>(work.packet.group(i));
    store(work, objects.data(), band, sample.object);
  }

  template <int K>
  void locate(const Moment& moment, GroupRotations<K>& rotations, Work<K>& work) const {
    if (work.hits == 0) return;
    HitTriangles<K> triangles;
    triangles.gather(*scene_, work.triangle);
    rotations.select(work.packet, moment.groups);
    locate_on_textures<K>(work.packet, *work.block, work.first, footprint_, rotations, triangles, work.at);
    work.material = triangles.material;
  }

  template <int K>
  void shade(const Moment& moment, GroupRotations<K>& rotations, Work<K>& work) const {
    SurfaceColours<K> colours;
    colours.look_up(*scene_, work.material, work.at, work.hits);
    const std::uint32_t lit = moment.lighting ? work.hits & ~colours.unlit : 0;
    if (lit != 0) {
      rotations.select(work.packet, moment.groups);
      SurfacePoints<K> surface;
      surface.take(*scene_, work.packet, work.triangle, rotations);
      const LightOnSurfaces<K> light(*moment.lighting, moment.groups);
      const std::array<float, K> received = light.at(surface, lit);
      for (unsigned i = 0; i < K; ++i) colours.base[i] *= (lit >> i & 1U) != 0 ? received[i] : 1.0F;
    }
    for (unsigned i = 0; i < K; ++i)
      work.sum[i] += (work.hits >> i & 1U) != 0 ? colours.base[i] + colours.emission[i] : background_;
  }

  std::shared_ptr<const RaycastScene> scene_;
  float background_;
  std::vector<Eigen::Vector2f> offsets_;
  float footprint_;  // of one ray, in pixels
  PixelRays rays_;
  RayBlocks blocks_;
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
