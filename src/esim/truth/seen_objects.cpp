#include "esim/truth/seen_objects.h"

#include <algorithm>

namespace esim::inline truth {

SeenObjects::SeenObjects(int width, int height)
    : width_(width), pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}

void SeenObjects::add(const Image<std::uint16_t>& object, TimeNs t, std::span<const Tile> tiles) {
  if (object.empty()) return;
  for (const Tile& tile : tiles) {
    for (int y = tile.y; y < tile.y + tile.height; ++y) {
      const std::uint16_t* const row = object.row(y);
      Pixel* const pixels = pixels_.data() + static_cast<std::ptrdiff_t>(y) * width_;
      for (int x = tile.x; x < tile.x + tile.width; ++x) {
        Pixel& pixel = pixels[x];
        if (t <= pixel.last) continue;
        const std::uint16_t before = pixel.changes.empty() ? 0 : pixel.changes.back().object;
        if (row[x] != before) {
          const bool first = pixel.last == std::numeric_limits<TimeNs>::min();
          pixel.changes.push_back({first ? pixel.last : pixel.last + (t - pixel.last) / 2, row[x]});
          ++changes_;
        }
        pixel.last = t;
      }
    }
  }
}

std::uint16_t SeenObjects::at(int x, int y, TimeNs t) const {
  const std::vector<Change>& changes =
      pixels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)].changes;
  const auto later = std::ranges::upper_bound(changes, t, {}, &Change::from);
  return later == changes.begin() ? 0 : std::prev(later)->object;
}

void SeenObjects::forget_before(TimeNs t) {
  changes_ = 0;
  for (Pixel& pixel : pixels_) {
    const auto later = std::ranges::upper_bound(pixel.changes, t, {}, &Change::from);
    if (later - pixel.changes.begin() > 1) pixel.changes.erase(pixel.changes.begin(), std::prev(later));
    changes_ += pixel.changes.size();
  }
  limit_ = std::max(std::size_t{1} << 20, 2 * changes_);
}

}  // namespace esim::inline truth
