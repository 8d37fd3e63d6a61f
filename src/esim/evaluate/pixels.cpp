#include "esim/evaluate/pixels.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace esim::inline evaluate {

std::vector<PixelPosition> spread_pixels(int width, int height, int count) {
  const std::size_t all = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  const std::size_t wanted = count <= 0 ? all : std::min(all, static_cast<std::size_t>(count));
  std::vector<PixelPosition> pixels;
  pixels.reserve(wanted);
  if (wanted == all) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) pixels.push_back({x, y});
    }
    return pixels;
  }
  constexpr double kPlastic = 1.32471795724474602596;
  Image<char> taken(width, height);
  for (std::uint64_t k = 1; pixels.size() < wanted; ++k) {
    const double u = static_cast<double>(k) / kPlastic, v = static_cast<double>(k) / (kPlastic * kPlastic);
    const int x = std::min(width - 1, static_cast<int>((u - std::floor(u)) * width));
    const int y = std::min(height - 1, static_cast<int>((v - std::floor(v)) * height));
    if (taken(x, y) == 0) pixels.push_back({x, y});
    taken(x, y) = 1;
  }
  return pixels;
}

PixelIndex::PixelIndex(int width, int height, const std::vector<PixelPosition>& pixels)
    : pixels_(pixels), cells_((width + kCell - 1) / kCell, (height + kCell - 1) / kCell) {
  for (std::size_t i = 0; i < pixels_.size(); ++i)
    cells_(pixels_[i].x / kCell, pixels_[i].y / kCell).push_back(static_cast<int>(i));
}

}  // namespace esim::inline evaluate
