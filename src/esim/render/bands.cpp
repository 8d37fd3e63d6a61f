#include "esim/render/bands.h"

#include <algorithm>

#include "esim/render/motion_field.h"

namespace esim {
namespace {

constexpr int kBandRows = 8;

std::vector<Tile> cut_into_bands(const std::vector<Tile>& tiles) {
  std::vector<Tile> bands;
  for (const Tile& tile : tiles) {
    for (int y = 0; y < tile.height; y += kBandRows) {
      bands.push_back({tile.x, tile.y + y, tile.width, std::min(kBandRows, tile.height - y)});
    }
  }
  return bands;
}

}  // namespace

void render_in_bands(const RenderRequest& request, const PixelRays& rays, const Workers& workers, Sample& sample,
                     const std::function<void(const Tile& band)>& shade) {
  render_in_bands(request, rays.x.width(), rays.x.height(), workers, sample, [&](const Tile& band) {
    shade(band);
    motion_field(rays, request.camera, band, sample);
  });
}

void render_in_bands(const RenderRequest& request, int width, int height, const Workers& workers, Sample& sample,
                     const std::function<void(const Tile& band)>& shade) {
  sample.resize(width, height);
  sample.t = request.t;
  sample.tiles = request.tiles;

  const std::vector<Tile> bands = cut_into_bands(request.tiles);
  workers.for_each(static_cast<int>(bands.size()), [&](int i) { shade(bands[static_cast<std::size_t>(i)]); });
}

}  // namespace esim
