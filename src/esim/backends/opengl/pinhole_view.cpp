#include "esim/backends/opengl/pinhole_view.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <variant>

#include "esim/core/error.h"

namespace esim {
namespace {

constexpr int kMargin = 2;  // pixels around what is looked up

/// How much a pixel's footprint stretches the least, of the bearing: its smaller singular value.
double smaller_stretch(double a, double b, double c, double d) {
  const double sum = a * a + b * b + c * c + d * d, determinant = a * d - b * c;
  const double root = std::sqrt(std::max(0.0, sum * sum - 4 * determinant * determinant));
  return std::sqrt(std::max(0.0, 0.5 * (sum - root)));
}

std::array<float, 4> clip_of(double fx, double fy, double cx, double cy, int width, int height) {
  // Pixel centres are at integers: pixel u spans [u - 0.5, u + 0.5].
  return {static_cast<float>(2 * fx / width), static_cast<float>(2 * fy / height),
          static_cast<float>((2 * cx + 1) / width - 1), static_cast<float>((2 * cy + 1) / height - 1)};
}

}  // namespace

PinholeView pinhole_view(const Camera& camera, const PixelRays& rays) {
  PinholeView view;
  view.camera_width_ = camera.width;
  view.distorts = !std::holds_alternative<NoDistortion>(camera.distortion);
  if (!view.distorts) {
    view.width = camera.width, view.height = camera.height;
    view.clip = clip_of(camera.fx, camera.fy, camera.cx, camera.cy, view.width, view.height);
    return view;
  }

  float left = std::numeric_limits<float>::max(), top = left, right = -left, bottom = -left;
  double finest = std::numeric_limits<double>::infinity();
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      left = std::min(left, rays.x(x, y)), right = std::max(right, rays.x(x, y));
      top = std::min(top, rays.y(x, y)), bottom = std::max(bottom, rays.y(x, y));
      finest =
          std::min(finest, smaller_stretch(rays.dx_du(x, y), rays.dx_dv(x, y), rays.dy_du(x, y), rays.dy_dv(x, y)));
    }
  }
  const double focal = 1 / finest;  // px: nowhere coarser than the camera's pixels
  const double width = focal * (right - left) + 2 * kMargin + 1, height = focal * (bottom - top) + 2 * kMargin + 1;
  constexpr double kLargest = 32768;
  if (!(width < kLargest && height < kLargest)) {
    throw UserError("gl: the camera sees too wide for OpenGL's pinhole (" + std::to_string(std::lround(width)) + " x " +
                    std::to_string(std::lround(height)) + " pixels would be needed); use engine: raycast");
  }
  view.width = static_cast<int>(std::ceil(width)), view.height = static_cast<int>(std::ceil(height));
  const double cx = kMargin - focal * left, cy = kMargin - focal * top;
  view.clip = clip_of(focal, focal, cx, cy, view.width, view.height);
  const auto scaled = [focal](float value) { return static_cast<float>(focal * value); };
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      view.centres.insert(view.centres.end(), {static_cast<float>(focal * rays.x(x, y) + cx),
                                               static_cast<float>(focal * rays.y(x, y) + cy)});
      view.footprints.insert(view.footprints.end(), {scaled(rays.dx_du(x, y)), scaled(rays.dx_dv(x, y)),
                                                     scaled(rays.dy_du(x, y)), scaled(rays.dy_dv(x, y))});
    }
  }
  return view;
}

Tile PinholeView::part_for(const Tile& tile) const {
  if (!distorts) return tile;
  float left = std::numeric_limits<float>::max(), top = left, right = -left, bottom = -left;
  const auto look_at = [&](int x, int y) {
    const std::size_t i =
        2 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(camera_width_) + static_cast<std::size_t>(x));
    left = std::min(left, centres[i]), right = std::max(right, centres[i]);
    top = std::min(top, centres[i + 1]), bottom = std::max(bottom, centres[i + 1]);
  };
  for (int y = tile.y; y < tile.y + tile.height; ++y) {
    for (int x = tile.x; x < tile.x + tile.width; ++x) look_at(x, y);
  }
  const int x0 = std::max(0, static_cast<int>(left) - kMargin), y0 = std::max(0, static_cast<int>(top) - kMargin);
  const int x1 = std::min(width, static_cast<int>(right) + kMargin + 2),
            y1 = std::min(height, static_cast<int>(bottom) + kMargin + 2);
  return {x0, y0, x1 - x0, y1 - y0};
}

}  // namespace esim
