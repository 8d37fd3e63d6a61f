#include "esim/backends/splats/splat_renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <utility>

#include "esim/backends/splats/compositor.h"
#include "esim/backends/splats/projection.h"
#include "esim/render/bands.h"
#include "esim/render/motion_field.h"
#include "esim/scene/planes.h"
#include "esim/scene/splats/display_curve.h"

namespace esim::inline backends::inline splats {
namespace {

/// The part of a bin that a request needs.
struct BinPart {
  int left, top;            // of the bin
  std::vector<Tile> tiles;  // inside the bin
};

/// Cuts tiles at the bins.
std::vector<BinPart> parts_of(const std::vector<Tile>& tiles, int width, int height) {
  const int columns = (width + Compositor::kSide - 1) / Compositor::kSide,
            rows = (height + Compositor::kSide - 1) / Compositor::kSide;
  std::vector<int> index(static_cast<std::size_t>(columns * rows), -1);
  std::vector<BinPart> parts;
  for (const Tile& tile : tiles) {
    for (int top = tile.y / Compositor::kSide * Compositor::kSide; top < tile.y + tile.height;
         top += Compositor::kSide) {
      for (int left = tile.x / Compositor::kSide * Compositor::kSide; left < tile.x + tile.width;
           left += Compositor::kSide) {
        const int x0 = std::max(left, tile.x), x1 = std::min(left + Compositor::kSide, tile.x + tile.width);
        const int y0 = std::max(top, tile.y), y1 = std::min(top + Compositor::kSide, tile.y + tile.height);
        int& part = index[static_cast<std::size_t>(top / Compositor::kSide * columns + left / Compositor::kSide)];
        if (part < 0) part = static_cast<int>(parts.size()), parts.push_back({left, top, {}});
        parts[static_cast<std::size_t>(part)].tiles.push_back({x0, y0, x1 - x0, y1 - y0});
      }
    }
  }
  return parts;
}

/// A cluster that may be visible in a request.
struct SeenCluster {
  std::size_t group, cluster;
  bool fine;    // or merged
  float share;  // of the opacity
};

class SplatRenderer final : public ProcessorRenderer {
 public:
  SplatRenderer(std::shared_ptr<const SplatScene> scene, const SplatOptions& options, const Camera& camera,
                const Workers& workers, ColourFilters filters, double footprint, SplatSurfaces surfaces)
      : scene_(std::move(scene)),
        options_(options),
        rays_(camera),
        grey_(scene_->light == SplatLight::linear && filters == ColourFilters::none),
        projector_(camera, options.projection, static_cast<float>(footprint), grey_),
        workers_(workers),
        filters_(filters),
        curve_(scene_->light, options.display_gamma),
        surfaces_(std::move(surfaces)) {
    for (int top = 0; top < rays_.x.height(); top += Compositor::kSide) {
      for (int left = 0; left < rays_.x.width(); left += Compositor::kSide)
        bins_.push_back(projector_.widened(bearings_of(left, top)));
    }
  }

  RendererTraits traits() const override {
    return {.name = "splats",
            .granularity = Granularity::tile,
            .at_infinity = false,
            .has_edges = false,
            .deforms = surfaces_.renderer != nullptr && surfaces_.renderer->traits().deforms};
  }

 private:
  struct Work;
  struct RequestWork;
  struct ThreadWork;

  void compute(std::span<const RenderRequest> requests, Sample& sample) const override;
  void collect(const RenderRequest& request, RequestWork& work) const;
  void render_part(const RenderRequest& request, const RequestWork& work, const BinPart& part, ThreadWork& thread,
                   Sample& sample) const;
  void write(const Compositor& compositor, int left, int top, const Tile& tile, Sample& sample) const;
  void render_surfaces(std::span<const RenderRequest> requests, Sample& sample) const;
  void keep_motion_of_surfaces(const Work& work, const BinPart& part, Sample& sample) const;

  /// Whether an object of a sample consists of surfaces.
  bool is_surface(std::size_t object) const {
    return object > 0 &&
           std::find(surfaces_.objects.begin(), surfaces_.objects.end(), object - 1) != surfaces_.objects.end();
  }

  BearingRect bearings_of(int left, int top) const;

  const BearingRect& bearings(const BinPart& part) const {
    const int columns = (rays_.x.width() + Compositor::kSide - 1) / Compositor::kSide;
    return bins_[static_cast<std::size_t>(part.top / Compositor::kSide * columns + part.left / Compositor::kSide)];
  }

  std::unique_ptr<Work> take_work() const {
    const std::lock_guard lock(mutex_);
    if (idle_.empty()) return std::make_unique<Work>();
    std::unique_ptr<Work> work = std::move(idle_.back());
    idle_.pop_back();
    return work;
  }

  void give_back(std::unique_ptr<Work> work) const {
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(work));
  }

  std::shared_ptr<const SplatScene> scene_;
  SplatOptions options_;
  PixelRays rays_;
  bool grey_;  // linear light can be blended as luminance
  Projector projector_;
  const Workers& workers_;
  ColourFilters filters_;
  DisplayCurve curve_;
  SplatSurfaces surfaces_;
  std::vector<BearingRect> bins_;  // where splats are that the bin may show
  mutable std::mutex mutex_;
  mutable std::vector<std::unique_ptr<Work>> idle_;  // memory, which is expensive to request for each image
};

/// What a request sees.
struct SplatRenderer::RequestWork {
  std::vector<SplatView> views;  // per group of the scene
  std::vector<BinPart> parts;
  std::vector<Twist> twists;
  ClusterBoxes boxes;  // of the last group
  std::vector<std::uint8_t> visible;
  std::vector<SeenCluster> seen;
  ClusterBoxes seen_boxes;
  std::size_t first = 0;  // of its clusters in Work::projected
  const ProjectedCluster* projected = nullptr;
};

struct SplatRenderer::ThreadWork {
  Compositor compositor;
  std::vector<std::uint8_t> visible;
};

struct SplatRenderer::Work {
  std::vector<RequestWork> requests;
  std::vector<ProjectedCluster> projected;
  std::vector<ThreadWork> threads;
  Image<float> motion_x, motion_y;  // V of the surfaces, if they deform
};

/// The bearings of all places in a bin.
BearingRect SplatRenderer::bearings_of(int left, int top) const {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  BearingRect rect{kInfinity, -kInfinity, kInfinity, -kInfinity};
  for (int y = top; y < std::min(top + Compositor::kSide, rays_.x.height()); ++y) {
    for (int x = left; x < std::min(left + Compositor::kSide, rays_.x.width()); ++x) {
      const float half_width = std::abs(rays_.dx_du(x, y)) + std::abs(rays_.dx_dv(x, y));
      const float half_height = std::abs(rays_.dy_du(x, y)) + std::abs(rays_.dy_dv(x, y));
      rect.left = std::min(rect.left, rays_.x(x, y) - half_width);
      rect.right = std::max(rect.right, rays_.x(x, y) + half_width);
      rect.top = std::min(rect.top, rays_.y(x, y) - half_height);
      rect.bottom = std::max(rect.bottom, rays_.y(x, y) + half_height);
    }
  }
  return rect;
}

/// Finds the clusters that a request may see.
void SplatRenderer::collect(const RenderRequest& request, RequestWork& work) const {
  work.views.clear(), work.seen.clear(), work.seen_boxes.resize(0);
  work.parts = parts_of(request.tiles, rays_.x.width(), rays_.x.height());
  work.twists = relative_twists(request);
  BearingRect whole = bearings(work.parts.front());
  for (const BinPart& part : work.parts) whole = whole.with(bearings(part));
  for (std::size_t g = 0; g < scene_->groups.size(); ++g) {
    const SplatScene::Placed& group = scene_->groups[g];
    projector_.find_boxes(group, work.views.emplace_back(request, group.object, group.to_object), work.boxes);
    work.boxes.find_visible(whole, work.visible);
    for (std::size_t c = 0; c < work.visible.size(); ++c) {
      if (work.visible[c] == 0) continue;
      const float share = work.boxes.fine[c];
      if (share > 0) work.seen.push_back({g, c, true, share}), work.seen_boxes.append(work.boxes, c);
      if (share < 1) work.seen.push_back({g, c, false, 1 - share}), work.seen_boxes.append(work.boxes, c);
    }
  }
  constexpr std::size_t kFewParts = 16;  // whose rectangle may be much larger than they are
  if (work.parts.size() == 1 || work.parts.size() > kFewParts) return;
  std::vector<std::uint8_t> anywhere(work.seen.size());
  for (const BinPart& part : work.parts) {
    work.seen_boxes.find_visible(bearings(part), work.visible);
    for (std::size_t i = 0; i < anywhere.size(); ++i) anywhere[i] |= work.visible[i];
  }
  work.boxes.resize(0);
  std::swap(work.boxes, work.seen_boxes);
  std::vector<SeenCluster> all;
  all.swap(work.seen);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (anywhere[i] != 0) work.seen.push_back(all[i]), work.seen_boxes.append(work.boxes, i);
  }
}

/// Fills the sample with the light, the depth and the objects of the surfaces, numbered as in their renderer.
void SplatRenderer::render_surfaces(std::span<const RenderRequest> requests, Sample& sample) const {
  std::vector<RenderRequest> others(requests.begin(), requests.end());
  for (RenderRequest& request : others) {
    request.which_objects = request.wants_objects();
    const std::vector<Kinematics> all = std::move(request.objects);
    request.objects.clear();
    for (const std::size_t object : surfaces_.objects) request.objects.push_back(all[object]);
  }
  surfaces_.renderer->start_together(std::move(others))->finish(sample);
}

void SplatRenderer::compute(std::span<const RenderRequest> requests, Sample& sample) const {
  if (surfaces_.renderer != nullptr) render_surfaces(requests, sample);
  std::unique_ptr<Work> work = take_work();
  const bool deforms = traits().deforms;
  if (deforms) work->motion_x = sample.motion_x, work->motion_y = sample.motion_y;
  prepare(requests, rays_.x.width(), rays_.x.height(), sample, deforms);

  work->requests.resize(requests.size());
  work->threads.resize(static_cast<std::size_t>(workers_.threads()), {Compositor(options_.order, grey_), {}});
  workers_.for_each(static_cast<int>(requests.size()), [&](int r) {
    collect(requests[static_cast<std::size_t>(r)], work->requests[static_cast<std::size_t>(r)]);
  });

  std::vector<std::pair<std::size_t, std::size_t>> clusters, parts;  // of all requests
  for (std::size_t r = 0; r < requests.size(); ++r) {
    work->requests[r].first = clusters.size();
    for (std::size_t i = 0; i < work->requests[r].seen.size(); ++i) clusters.emplace_back(r, i);
    for (std::size_t i = 0; i < work->requests[r].parts.size(); ++i) parts.emplace_back(r, i);
  }
  if (work->projected.size() < clusters.size()) work->projected.resize(clusters.size());
  for (RequestWork& request : work->requests) request.projected = work->projected.data() + request.first;

  constexpr std::size_t kClustersAtOnce = 16;
  const std::size_t pieces = (clusters.size() + kClustersAtOnce - 1) / kClustersAtOnce;
  workers_.for_each(static_cast<int>(pieces), [&](int piece) {
    const std::size_t first = static_cast<std::size_t>(piece) * kClustersAtOnce;
    for (std::size_t i = first; i < std::min(first + kClustersAtOnce, clusters.size()); ++i) {
      const auto& [r, k] = clusters[i];
      const SeenCluster& seen = work->requests[r].seen[k];
      const SplatScene::Placed& placed = scene_->groups[seen.group];
      const SplatGroup& group = seen.fine ? placed.fine : placed.merged;
      projector_.project(group, group.clusters[seen.cluster], work->requests[r].views[seen.group], seen.share,
                         static_cast<float>(placed.object), work->projected[i]);
    }
  });

  workers_.for_each_with_worker(static_cast<int>(parts.size()), [&](int i, int worker) {
    const auto& [r, k] = parts[static_cast<std::size_t>(i)];
    render_part(requests[r], work->requests[r], work->requests[r].parts[k],
                work->threads[static_cast<std::size_t>(worker)], sample);
    if (deforms) keep_motion_of_surfaces(*work, work->requests[r].parts[k], sample);
  });
  give_back(std::move(work));
}

/// Restores V of the surfaces where they are visible, since they deform.
void SplatRenderer::keep_motion_of_surfaces(const Work& work, const BinPart& part, Sample& sample) const {
  for (const Tile& tile : part.tiles) {
    for (int y = tile.y; y < tile.y + tile.height; ++y) {
      for (int x = tile.x; x < tile.x + tile.width; ++x) {
        if (!is_surface(sample.object(x, y))) continue;
        sample.motion_x(x, y) = work.motion_x(x, y), sample.motion_y(x, y) = work.motion_y(x, y);
      }
    }
  }
}

void SplatRenderer::render_part(const RenderRequest& request, const RequestWork& work, const BinPart& part,
                                ThreadWork& thread, Sample& sample) const {
  auto& [compositor, visible] = thread;
  const int left = part.left, top = part.top, right = left + Compositor::kSide - 1,
            bottom = top + Compositor::kSide - 1;
  compositor.start(left, top);
  if (surfaces_.renderer != nullptr) {
    for (const Tile& tile : part.tiles) {
      for (int y = tile.y; y < tile.y + tile.height; ++y) {
        for (int x = tile.x; x < tile.x + tile.width; ++x)
          compositor.set_surface(x - left, y - top, 1 / sample.depth(x, y));
      }
    }
  }
  // Clusters outside are left out by the same rule in each request, so that a tile equals the frame.
  work.seen_boxes.find_visible(bearings(part), visible);
  for (std::size_t i = 0; i < work.seen.size(); ++i) {
    const ProjectedCluster& cluster = work.projected[i];
    if (visible[i] == 0) continue;
    if (cluster.last_column < left || cluster.first_column > right || cluster.last_row < top ||
        cluster.first_row > bottom)
      continue;
    std::array<std::uint16_t, ProjectedCluster::kMost> inside;
    const auto x0 = static_cast<std::int16_t>(left), x1 = static_cast<std::int16_t>(right);
    const auto y0 = static_cast<std::int16_t>(top), y1 = static_cast<std::int16_t>(bottom);
    for (std::size_t k = 0; k < cluster.count; ++k) {
      inside[k] = static_cast<std::uint16_t>((cluster.left[k] <= x1) & (cluster.right[k] >= x0) &
                                             (cluster.top[k] <= y1) & (cluster.bottom[k] >= y0));
    }
    for (std::size_t k = 0; k < cluster.count; ++k) {
      if (inside[k] == 0) continue;
      compositor.add(cluster.splats[k], cluster.left[k], cluster.right[k], cluster.top[k], cluster.bottom[k]);
    }
  }
  compositor.blend();
  for (const Tile& tile : part.tiles) {
    write(compositor, left, top, tile, sample);
    motion_field(rays_, work.twists, tile, sample, request.motion_rows);
  }
}

void SplatRenderer::write(const Compositor& compositor, int left, int top, const Tile& tile, Sample& sample) const {
  const bool objects = !sample.object.empty();
  for (int y = tile.y; y < tile.y + tile.height; ++y) {
    for (int x = tile.x; x < tile.x + tile.width; ++x) {
      const Compositor::Pixel pixel = compositor.pixel(x - left, y - top);
      const float light = surfaces_.renderer != nullptr ? sample.irradiance(x, y) : options_.background;
      const float behind = pixel.transmittance * curve_.encoded(light / options_.gain);
      const auto linear = [&](std::size_t colour) { return curve_.linear(pixel.colour[colour] + behind); };
      float value = 0;
      if (grey_) {
        value = linear(0);
      } else if (filters_ == ColourFilters::none) {
        value = luminance(linear(0), linear(1), linear(2));
      } else {
        value = linear(colour_at(x, y));
      }
      sample.irradiance(x, y) = options_.gain * value;
      if (pixel.nearness > 0) {
        sample.depth(x, y) = 1 / pixel.nearness;
        if (objects) sample.object(x, y) = static_cast<std::uint16_t>(pixel.object);
      } else if (surfaces_.renderer == nullptr) {
        sample.depth(x, y) = std::numeric_limits<float>::infinity();
        if (objects) sample.object(x, y) = 0;
      } else if (objects && sample.object(x, y) > 0) {
        sample.object(x, y) = static_cast<std::uint16_t>(surfaces_.objects[sample.object(x, y) - 1U] + 1);
      }
    }
  }
}

}  // namespace

std::unique_ptr<Renderer> make_splat_renderer(std::shared_ptr<const SplatScene> scene, const SplatOptions& options,
                                              const Camera& camera, const Workers& workers, ColourFilters filters,
                                              double footprint, SplatSurfaces surfaces) {
  return std::make_unique<SplatRenderer>(std::move(scene), options, camera, workers, filters, footprint,
                                         std::move(surfaces));
}

}  // namespace esim::inline backends::inline splats
