#include "esim/filters/region_filter.h"

#include <algorithm>
#include <cstddef>

namespace esim::inline filters {

RegionFilter::RegionFilter(const RegionFilterOptions& options, int width, int height)
    : width_(static_cast<std::size_t>(width)) {
  const bool everything = options.windows.empty();
  passes_.assign(width_ * static_cast<std::size_t>(height), everything || options.invert ? 1 : 0);
  for (const RegionOptions& window : options.windows) {
    const int last_x = std::min(window.x + window.width, width), last_y = std::min(window.y + window.height, height);
    for (int y = window.y; y < last_y; ++y) {
      for (int x = window.x; x < last_x; ++x)
        passes_[static_cast<std::size_t>(y) * width_ + static_cast<std::size_t>(x)] = options.invert ? 0 : 1;
    }
  }
  for (const MaskedPixelOptions& pixel : options.masked_pixels) {
    if (pixel.x < width && pixel.y < height)
      passes_[static_cast<std::size_t>(pixel.y) * width_ + static_cast<std::size_t>(pixel.x)] = 0;
  }
}

void RegionFilter::process(EventSpan events, std::vector<Event>& out) {
  for (const Event& event : events) {
    if (passes_[event.y * width_ + event.x] != 0) out.push_back(event);
  }
}

}  // namespace esim::inline filters
