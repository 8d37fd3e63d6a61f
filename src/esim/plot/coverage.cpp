#include "esim/plot/coverage.h"

#include <cairo.h>

#include <algorithm>
#include <memory>
#include <string>

#include "esim/core/error.h"

namespace esim::inline plot {

Image<std::uint8_t> cover(const Tile& box, const std::function<void(_cairo* context)>& draw) {
  Image<std::uint8_t> coverage(box.width, box.height);
  if (coverage.empty()) return coverage;
  const std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface(
      cairo_image_surface_create(CAIRO_FORMAT_A8, box.width, box.height), &cairo_surface_destroy);
  const std::unique_ptr<cairo_t, decltype(&cairo_destroy)> context(cairo_create(surface.get()), &cairo_destroy);
  cairo_translate(context.get(), -box.x, -box.y);
  draw(context.get());
  if (const cairo_status_t status = cairo_status(context.get()); status != CAIRO_STATUS_SUCCESS)
    throw Error(std::string("a figure could not be drawn: ") + cairo_status_to_string(status));
  cairo_surface_flush(surface.get());
  const unsigned char* const data = cairo_image_surface_get_data(surface.get());
  const int stride = cairo_image_surface_get_stride(surface.get());
  for (int y = 0; y < box.height; ++y)
    std::copy_n(data + static_cast<std::ptrdiff_t>(y) * stride, box.width, coverage.row(y));
  return coverage;
}

Tile intersect(const Tile& a, const Tile& b) {
  const int x = std::max(a.x, b.x), y = std::max(a.y, b.y);
  return {x, y, std::max(0, std::min(a.x + a.width, b.x + b.width) - x),
          std::max(0, std::min(a.y + a.height, b.y + b.height) - y)};
}

}  // namespace esim::inline plot
