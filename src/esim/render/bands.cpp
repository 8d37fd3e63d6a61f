#include "esim/render/bands.h"

#include <algorithm>

#include "esim/render/motion_field.h"

namespace esim {
namespace {

constexpr int kBandRows = 8;

/// Bands end at multiples of kBandRows, wherever the tile begins: renderers may work in small blocks.
std::vector<Tile> cut_into_bands(const std::vector<Tile>& tiles) {
  std::vector<Tile> bands;
  for (const Tile& tile : tiles) {
    const int end = tile.y + tile.height;
    for (int y = tile.y; y < end; y += bands.back().height)
      bands.push_back({tile.x, y, tile.width, std::min(kBandRows - y % kBandRows, end - y)});
  }
  return bands;
}

}  // namespace

void prepare(const RenderRequest& request, int width, int height, Sample& sample) {
  sample.resize(width, height, request.wants_objects());
  if (request.objects.empty()) sample.object.fill(0);
  sample.t = request.t;
  sample.tiles = request.tiles;
}

void render_in_bands(const RenderRequest& request, const PixelRays& rays, const Workers& workers, Sample& sample,
                     const std::function<void(const Tile& band)>& shade) {
  render_in_bands(request, rays.x.width(), rays.x.height(), workers, sample, [&](const Tile& band) {
    shade(band);
    motion_field(rays, request, band, sample);
  });
}

void render_in_bands(const RenderRequest& request, int width, int height, const Workers& workers, Sample& sample,
                     const std::function<void(const Tile& band)>& shade) {
  prepare(request, width, height, sample);
  const std::vector<Tile> bands = cut_into_bands(request.tiles);
  workers.for_each(static_cast<int>(bands.size()), [&](int i) { shade(bands[static_cast<std::size_t>(i)]); });
}

}  // namespace esim
