#include "esim/render/bands.h"

#include <algorithm>
#include <vector>

#include "esim/render/motion_field.h"

namespace esim::inline render {
namespace {

constexpr int kBandRows = 8;

// Size of a piece of a parallel loop: a single band of a small tile is too little work for a task.
constexpr std::size_t kPixelsPerPiece = 1024;

struct Band {
  std::size_t which;  // request
  Tile tile;
};

/// Bands end at multiples of kBandRows, wherever the tile begins, so that renderers can work in small blocks.
std::vector<Band> cut_into_bands(std::span<const RenderRequest> requests) {
  std::vector<Band> bands;
  for (std::size_t which = 0; which < requests.size(); ++which) {
    for (const Tile& tile : requests[which].tiles) {
      const int end = tile.y + tile.height;
      for (int y = tile.y; y < end; y += bands.back().tile.height)
        bands.push_back({which, {tile.x, y, tile.width, std::min(kBandRows - y % kBandRows, end - y)}});
    }
  }
  return bands;
}

/// Where the pieces of a parallel loop over bands begin, and the end.
std::vector<std::size_t> cut_into_pieces(const std::vector<Band>& bands) {
  std::vector<std::size_t> begins;
  std::size_t pixels = kPixelsPerPiece;  // of the current piece
  for (std::size_t i = 0; i < bands.size(); ++i) {
    if (pixels >= kPixelsPerPiece) begins.push_back(i), pixels = 0;
    pixels += bands[i].tile.area();
  }
  begins.push_back(bands.size());
  return begins;
}

}  // namespace

void prepare(std::span<const RenderRequest> requests, int width, int height, Sample& sample, bool deforms) {
  const RenderRequest& first = requests[0];
  sample.resize(width, height, first.wants_objects(), deforms);
  if (first.objects.empty()) sample.object.fill(0);
  sample.t = first.t;
  sample.tiles = first.tiles;
  for (const RenderRequest& request : requests.subspan(1))
    sample.tiles.insert(sample.tiles.end(), request.tiles.begin(), request.tiles.end());
}

void render_in_bands(std::span<const RenderRequest> requests, const PixelRays& rays, const Workers& workers,
                     Sample& sample, const std::function<void(std::size_t which, const Tile& band)>& shade) {
  std::vector<std::vector<Twist>> twists;
  for (const RenderRequest& request : requests) twists.push_back(relative_twists(request));
  render_in_bands(requests, rays.x.width(), rays.x.height(), workers, sample, [&](std::size_t which, const Tile& band) {
    shade(which, band);
    motion_field(rays, twists[which], band, sample, requests[which].motion_rows);
  });
}

void render_in_bands(std::span<const RenderRequest> requests, int width, int height, const Workers& workers,
                     Sample& sample, const std::function<void(std::size_t which, const Tile& band)>& shade,
                     bool deforms) {
  prepare(requests, width, height, sample, deforms);
  const std::vector<Band> bands = cut_into_bands(requests);
  const std::vector<std::size_t> begins = cut_into_pieces(bands);
  workers.for_each(static_cast<int>(begins.size()) - 1, [&](int piece) {
    const auto p = static_cast<std::size_t>(piece);
    for (std::size_t i = begins[p]; i < begins[p + 1]; ++i) shade(bands[i].which, bands[i].tile);
  });
}

}  // namespace esim::inline render
