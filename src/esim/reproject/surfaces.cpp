#include "esim/reproject/surfaces.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace esim::inline reproject {
namespace {

/// Neighbouring pixels belong to different surfaces if 1/Z deviates by more than this fraction from the straight line
/// through their neighbours.
constexpr float kDiscontinuity = 0.01F;

/// A surface has a crease if the slope of 1/Z changes by more than this between neighbouring pixels, in 1/Z per focal
/// length: by 2 at a corner of a room seen along its bisector.
constexpr double kCrease = 1.5;

/// The smaller of the differences to both sides, unless it is a discontinuity.
float slope(float before, float here, float after) {
  const float a = here - before, b = after - here;
  const float smaller = std::fabs(a) < std::fabs(b) ? a : b;
  const bool smooth = std::fabs(a - b) <= kDiscontinuity * here || std::fabs(smaller) <= kDiscontinuity * here;
  return smooth ? smaller : 0.0F;
}

/// Nearness of each pixel.
Image<float> inverse(const Image<float>& depth, const Workers& workers) {
  Image<float> nearness(depth.width(), depth.height());
  workers.for_each(depth.height(), [&](int y) {
    for (int x = 0; x < depth.width(); ++x) {
      const float z = depth(x, y), w = z > 0 ? 1.0F / z : 0.0F;  // not a number: as if at infinity
      nearness(x, y) = w <= std::numeric_limits<float>::max() ? w : 0.0F;
    }
  });
  return nearness;
}

/// For each pixel, the value that `before` sorts first among the pixels within `reach` in x and y.
template <typename Before>
Image<float> first_around(const Image<float>& in, int reach, const Before& before, const Workers& workers) {
  const int width = in.width(), height = in.height();
  const auto first = [&](float a, float b) { return before(b, a) ? b : a; };
  Image<float> rows = in, out(width, height);
  workers.for_each(height, [&](int y) {
    float* const to = rows.row(y);
    const float* const from = in.row(y);
    for (int i = 1; i <= reach; ++i) {
      for (int x = 0; x < width - i; ++x) to[x] = first(to[x], from[x + i]);
      for (int x = i; x < width; ++x) to[x] = first(to[x], from[x - i]);
    }
  });
  workers.for_each(height, [&](int y) {
    float* const to = out.row(y);
    std::copy_n(rows.row(y), width, to);
    for (int j = std::max(y - reach, 0); j <= std::min(y + reach, height - 1); ++j)
      for (int x = 0; x < width; ++x) to[x] = first(to[x], rows(x, j));
  });
  return out;
}

Image<float> nearest_around(const Image<float>& nearness, int reach, const Workers& workers) {
  return first_around(
      nearness, reach, [](float a, float b) { return a > b; }, workers);
}

Image<float> farthest_around(const Image<float>& nearness, int reach, const Workers& workers) {
  return first_around(
      nearness, reach, [](float a, float b) { return a < b; }, workers);
}

}  // namespace

Surfaces::Surfaces(const Image<float>& depth, double focal_px, const Workers& workers)
    : workers_(workers),
      bent_(static_cast<float>(kCrease / focal_px)),
      nearness_(inverse(depth, workers)),
      slope_x_(depth.width(), depth.height()),
      slope_y_(slope_x_) {
  const int right = depth.width() - 1, bottom = depth.height() - 1;
  const Image<float>& w = nearness_;
  for_each_pixel([&](int x, int y) {
    slope_x_(x, y) = slope(w(std::max(x - 1, 0), y), w(x, y), w(std::min(x + 1, right), y));
    slope_y_(x, y) = slope(w(x, std::max(y - 1, 0)), w(x, y), w(x, std::min(y + 1, bottom)));
  });
}

template <typename Body>
void Surfaces::for_each_pixel(const Body& body) const {
  workers_.for_each(nearness_.height(), [&](int y) {
    for (int x = 0; x < nearness_.width(); ++x) body(x, y);
  });
}

/// Minimum change of nearness within `reach` pixels that indicates another surface.
float Surfaces::unlike(int x, int y, int reach) const {
  return (static_cast<float>(reach) + 0.5F) * (std::fabs(slope_x_(x, y)) + std::fabs(slope_y_(x, y))) +
         kDiscontinuity * nearness_(x, y);
}

bool Surfaces::is_crease(int x, int y) const {
  const Image<float>& w = nearness_;
  if (x == 0 || y == 0 || x == w.width() - 1 || y == w.height() - 1) return false;
  const float twice = 2 * w(x, y);
  const float across = w(x - 1, y) - twice + w(x + 1, y), down = w(x, y - 1) - twice + w(x, y + 1);
  return std::max(std::fabs(across), std::fabs(down)) > bent_ * w(x, y);
}

Image<float> Surfaces::front(int reach) const {
  Image<float> front = nearest_around(nearness_, reach, workers_);
  for_each_pixel([&](int x, int y) {
    if (front(x, y) - nearness_(x, y) <= unlike(x, y, reach)) front(x, y) = nearness_(x, y);
  });
  return front;
}

Image<Edge> Surfaces::edges() const {
  const Image<float> nearest = nearest_around(nearness_, 1, workers_),
                     farthest = farthest_around(nearness_, 1, workers_);
  Image<Edge> edges(nearness_.width(), nearness_.height());
  for_each_pixel([&](int x, int y) {
    const float here = nearness_(x, y), least = unlike(x, y, 1);
    const bool outline = here - farthest(x, y) > least, outlined = nearest(x, y) - here > least;
    edges(x, y) = outline ? Edge::outline : (!outlined && is_crease(x, y) ? Edge::crease : Edge::none);
  });
  return edges;
}

void Surfaces::add_point(const PixelRays& rays, const Image<std::uint16_t>& part, Edge edge, int x, int y,
                         SurfacePoints& to) const {
  to.x.push_back(rays.x(x, y)), to.y.push_back(rays.y(x, y));
  to.nearness.push_back(nearness_(x, y));
  to.slope_x.push_back(slope_x_(x, y)), to.slope_y.push_back(slope_y_(x, y));
  if (!part.empty()) to.part.push_back(part(x, y));
  to.edge.push_back(edge);
}

}  // namespace esim::inline reproject
