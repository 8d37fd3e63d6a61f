#include "esim/plot/canvas.h"

#include <cairo.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "esim/plot/coverage.h"
#include "esim/plot/text.h"

namespace esim::inline plot {
namespace {

bool is_finite(const Spot& spot) { return std::isfinite(spot.x) && std::isfinite(spot.y); }

// Cairo's coordinates have 24 bits before the point.
double limited(double v) { return std::clamp(v, -1e6, 1e6); }

/// The smallest tile that contains all points with `margin` around them.
class Bounds {
 public:
  void add(const Spot& spot) {
    if (!is_finite(spot)) return;
    left_ = std::min(left_, spot.x);
    right_ = std::max(right_, spot.x);
    top_ = std::min(top_, spot.y);
    bottom_ = std::max(bottom_, spot.y);
  }
  Tile within(const Tile& clip, double margin) const {
    if (left_ > right_) return {};
    const auto edge = [](double v) { return static_cast<int>(std::floor(limited(v))); };
    const int x = edge(left_ - margin), y = edge(top_ - margin);
    return intersect({x, y, edge(right_ + margin) + 2 - x, edge(bottom_ + margin) + 2 - y}, clip);
  }

 private:
  double left_ = std::numeric_limits<double>::infinity(), right_ = -left_, top_ = left_, bottom_ = -left_;
};

// Pixel centres are integers on a canvas, but halves in Cairo.
void move_to(cairo_t* context, const Spot& spot) {
  cairo_move_to(context, limited(spot.x + 0.5), limited(spot.y + 0.5));
}
void line_to(cairo_t* context, const Spot& spot) {
  cairo_line_to(context, limited(spot.x + 0.5), limited(spot.y + 0.5));
}

}  // namespace

void Canvas::clip(const Tile& area) { clip_ = intersect(area, pixels_.bounds()); }

void Canvas::draw(const Image<Rgb>& image, int x, int y) {
  const Tile visible = intersect({x, y, image.width(), image.height()}, clip_);
  for (int row = visible.y; row < visible.y + visible.height; ++row) {
    std::copy_n(image.row(row - y) + (visible.x - x), visible.width, pixels_.row(row) + visible.x);
  }
}

void Canvas::fill(const Tile& area, Rgb colour) {
  const Tile visible = intersect(area, clip_);
  for (int row = visible.y; row < visible.y + visible.height; ++row) {
    std::fill_n(pixels_.row(row) + visible.x, visible.width, colour);
  }
}

void Canvas::outline(const Tile& area, Rgb colour) {
  fill({area.x, area.y, area.width, 1}, colour);
  fill({area.x, area.y + area.height - 1, area.width, 1}, colour);
  fill({area.x, area.y, 1, area.height}, colour);
  fill({area.x + area.width - 1, area.y, 1, area.height}, colour);
}

void Canvas::blend(const Image<std::uint8_t>& coverage, int x, int y, Rgb colour) {
  const Tile visible = intersect({x, y, coverage.width(), coverage.height()}, clip_);
  for (int row = visible.y; row < visible.y + visible.height; ++row) {
    const std::uint8_t* covered = coverage.row(row - y) + (visible.x - x);
    Rgb* const pixels = pixels_.row(row) + visible.x;
    for (int i = 0; i < visible.width; ++i) {
      if (covered[i] != 0) pixels[i] = mix(pixels[i], colour, static_cast<float>(covered[i]) / 255.0f);
    }
  }
}

void Canvas::polyline(std::span<const Spot> points, double width, Rgb colour) {
  Bounds bounds;
  for (const Spot& point : points) bounds.add(point);
  const Tile box = bounds.within(clip_, width);
  const Image<std::uint8_t> coverage = cover(box, [&](cairo_t* context) {
    cairo_set_line_width(context, width);
    cairo_set_line_join(context, CAIRO_LINE_JOIN_ROUND);
    cairo_set_line_cap(context, CAIRO_LINE_CAP_ROUND);
    bool interrupted = true;
    for (const Spot& point : points) {
      if (is_finite(point)) interrupted ? move_to(context, point) : line_to(context, point);
      interrupted = !is_finite(point);
    }
    cairo_stroke(context);
  });
  blend(coverage, box.x, box.y, colour);
}

void Canvas::strokes(std::span<const Stroke> lines, double width, Rgb colour) {
  Bounds bounds;
  for (const Stroke& line : lines) {
    for (const Spot& end : line) bounds.add(end);
  }
  const Tile box = bounds.within(clip_, width);
  const Image<std::uint8_t> coverage = cover(box, [&](cairo_t* context) {
    cairo_set_line_width(context, width);
    for (const auto& [from, to] : lines) {
      if (!is_finite(from) || !is_finite(to)) continue;
      move_to(context, from);
      line_to(context, to);
    }
    cairo_stroke(context);
  });
  blend(coverage, box.x, box.y, colour);
}

void Canvas::disc(Spot centre, double radius, Rgb colour) {
  Bounds bounds;
  bounds.add(centre);
  const Tile box = bounds.within(clip_, radius + 1);
  const Image<std::uint8_t> coverage = cover(box, [&](cairo_t* context) {
    cairo_arc(context, limited(centre.x + 0.5), limited(centre.y + 0.5), radius, 0, 2 * std::numbers::pi);
    cairo_fill(context);
  });
  blend(coverage, box.x, box.y, colour);
}

int Canvas::text_width(std::string_view line, int height) { return draw_text(line, height).width; }

int Canvas::fitting_height(std::string_view line, int height, int width) {
  constexpr int kMinHeight = 6;
  while (height > kMinHeight && text_width(line, height) > width) --height;
  return height;
}

int Canvas::text(int x, int baseline, std::string_view line, int height, Rgb colour, Align align) {
  const TextMask& mask = draw_text(line, height);
  if (align == Align::centre) x -= mask.width / 2;
  if (align == Align::right) x -= mask.width;
  blend(mask.coverage, x + mask.left, baseline + mask.top, colour);
  return mask.width;
}

void Canvas::vertical_text(int baseline, int y, std::string_view line, int height, Rgb colour, Align align) {
  const TextMask mask = draw_text(line, height).turned();
  if (align == Align::centre) y += mask.width / 2;
  if (align == Align::right) y += mask.width;
  blend(mask.coverage, baseline + mask.left, y + mask.top, colour);
}

}  // namespace esim::inline plot
