#include "esim/image_cache/cached_renderer.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

#include "esim/core/inputs/sha256.h"
#include "esim/render/bands.h"
#include "esim/render/pixel_rays.h"

namespace esim::inline image_cache {
namespace {

/// To change when what is stored under a key changes.
constexpr std::string_view kLayout = "esim image 1";

/// The sum of numbers and texts.
class Key {
 public:
  template <typename T>
  requires std::is_arithmetic_v<T>
  void add(T number) { sum_.add(std::as_bytes(std::span(&number, 1))); }
  void add(std::string_view text) {
    add(text.size());
    sum_.add(std::as_bytes(std::span(text)));
  }
  void add(const SE3& pose) {
    for (const double number : pose.rotation.coeffs()) add(number);
    for (const double number : pose.translation) add(number);
  }
  void add(const Camera& camera) {
    add(camera.width), add(camera.height);
    add(camera.fx), add(camera.fy), add(camera.cx), add(camera.cy);
    add(camera.distortion.index());
    std::visit([&](const auto& model) { add_distortion(model); }, camera.distortion);
  }
  std::string finish() { return sum_.finish(); }

 private:
  void add_distortion(const NoDistortion&) {}
  void add_distortion(const RadialTangential& d) { add(d.k1), add(d.k2), add(d.p1), add(d.p2), add(d.k3); }
  void add_distortion(const Equidistant& d) { add(d.k1), add(d.k2), add(d.k3), add(d.k4); }
  void add_distortion(const Fov& d) { add(d.w); }

  Sha256 sum_;
};

/// Calls field(image) for each of a sample's images that are stored: E, Z and, if objects move, which are seen.
template <typename ASample, typename Field>
void for_each_field(const RenderRequest& request, ASample& sample, const Field& field) {
  field(sample.irradiance);
  field(sample.depth);
  if (!request.objects.empty()) field(sample.object);
}

std::size_t area_of(const RenderRequest& request) {
  std::size_t area = 0;
  for (const Tile& tile : request.tiles) area += tile.area();
  return area;
}

/// The size of what is stored for a request.
std::size_t stored_bytes(const RenderRequest& request) {
  const std::size_t per_pixel = 2 * sizeof(float) + (request.objects.empty() ? 0 : sizeof(std::uint16_t));
  return per_pixel * area_of(request);
}

/// The requested pixels of a sample. The first bytes of all numbers of an image come first, then all second ones, and
/// so on, since these are similar and become smaller by compression.
std::string packed(const RenderRequest& request, const Sample& sample) {
  const std::size_t area = area_of(request);
  std::string out(stored_bytes(request), '\0');
  char* plane = out.data();
  for_each_field(request, sample, [&]<typename T>(const Image<T>& image) {
    char* to = plane;
    for (const Tile& tile : request.tiles) {
      for (int y = tile.y; y < tile.y + tile.height; ++y) {
        const char* from = reinterpret_cast<const char*>(image.row(y) + tile.x);
        for (int i = 0; i < tile.width; ++i, ++to, from += sizeof(T)) {
          for (std::size_t k = 0; k < sizeof(T); ++k) to[k * area] = from[k];
        }
      }
    }
    plane += sizeof(T) * area;
  });
  return out;
}

/// The inverse.
void unpack(const std::string& stored, const RenderRequest& request, Sample& sample) {
  const std::size_t area = area_of(request);
  const char* plane = stored.data();
  for_each_field(request, sample, [&]<typename T>(Image<T>& image) {
    const char* from = plane;
    for (const Tile& tile : request.tiles) {
      for (int y = tile.y; y < tile.y + tile.height; ++y) {
        char* to = reinterpret_cast<char*>(image.row(y) + tile.x);
        for (int i = 0; i < tile.width; ++i, ++from, to += sizeof(T)) {
          for (std::size_t k = 0; k < sizeof(T); ++k) to[k] = from[k * area];
        }
      }
    }
    plane += sizeof(T) * area;
  });
}

class CachedRenderer final : public Renderer {
 public:
  CachedRenderer(std::unique_ptr<Renderer> engine, std::shared_ptr<ImageCache> cache, std::string scene,
                 const Camera& camera, const Workers& workers)
      : engine_(std::move(engine)),
        cache_(std::move(cache)),
        scene_(std::move(scene)),
        camera_(camera),
        rays_(camera),
        workers_(workers) {}

  RendererTraits traits() const override { return engine_->traits(); }

  std::unique_ptr<Rendering> start(RenderRequest request) override {
    std::string key = key_of(request);
    if (std::optional<std::string> stored = cache_->load(key, stored_bytes(request)))
      return std::make_unique<Stored>(*this, std::move(request), std::move(*stored));
    std::unique_ptr<Rendering> rendering = engine_->start(request);
    return std::make_unique<Rendered>(*this, std::move(request), std::move(key), std::move(rendering));
  }

 private:
  struct Stored final : Rendering {
    Stored(CachedRenderer& from, RenderRequest what, std::string images)
        : renderer(from), request(std::move(what)), stored(std::move(images)) {}

    void finish(Sample& sample) override {
      prepare({&request, 1}, renderer.camera_.width, renderer.camera_.height, sample);
      unpack(stored, request, sample);
      const auto nothing = [](std::size_t, const Tile&) {};  // E, Z and the objects are there; V is missing
      render_in_bands({&request, 1}, renderer.rays_, renderer.workers_, sample, nothing);
      ++renderer.cache_->from_cache;
    }

    CachedRenderer& renderer;
    RenderRequest request;
    std::string stored;
  };

  struct Rendered final : Rendering {
    Rendered(CachedRenderer& from, RenderRequest what, std::string its_key, std::unique_ptr<Rendering> under_way)
        : renderer(from), request(std::move(what)), key(std::move(its_key)), rendering(std::move(under_way)) {}

    void finish(Sample& sample) override {
      rendering->finish(sample);
      ++renderer.cache_->from_engine;
      renderer.cache_->store(key, packed(request, sample));
    }

    CachedRenderer& renderer;
    RenderRequest request;
    std::string key;
    std::unique_ptr<Rendering> rendering;
  };

  std::string key_of(const RenderRequest& request) const {
    Key key;
    key.add(kLayout);
    key.add(scene_);
    key.add(camera_);
    key.add(request.camera.T_world_body);
    key.add(request.objects.size());
    for (const Kinematics& object : request.objects) key.add(object.T_world_body);
    for (const Tile& tile : request.tiles) {
      for (const int number : {tile.x, tile.y, tile.width, tile.height}) key.add(number);
    }
    return key.finish();
  }

  std::unique_ptr<Renderer> engine_;
  std::shared_ptr<ImageCache> cache_;
  std::string scene_;
  Camera camera_;
  PixelRays rays_;
  const Workers& workers_;
};

}  // namespace

std::unique_ptr<Renderer> with_image_cache(std::unique_ptr<Renderer> engine, std::shared_ptr<ImageCache> cache,
                                           std::string scene, const Camera& camera, const Workers& workers) {
  if (cache == nullptr) return engine;
  return std::make_unique<CachedRenderer>(std::move(engine), std::move(cache), std::move(scene), camera, workers);
}

}  // namespace esim::inline image_cache
