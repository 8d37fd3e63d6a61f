#include "esim/render/pinhole_view.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <variant>

#include "esim/core/error.h"

namespace esim::inline render {
namespace {

constexpr int kMargin = 2;  // pixels around the positions that are looked up

/// The smaller singular value of a pixel's footprint.
double smaller_stretch(double a, double b, double c, double d) {
  const double sum = a * a + b * b + c * c + d * d, determinant = a * d - b * c;
  const double root = std::sqrt(std::max(0.0, sum * sum - 4 * determinant * determinant));
  return std::sqrt(std::max(0.0, 0.5 * (sum - root)));
}

/// Whether a renderer with this limitation can draw the camera's own image.
bool is_drawn(const Camera& camera, Pinhole which) {
  if (!std::holds_alternative<NoDistortion>(camera.distortion)) return false;
  constexpr double kNothing_px = 1e-6;
  return which == Pinhole::any ||
         (std::fabs(camera.cx - 0.5 * (camera.width - 1)) < kNothing_px &&
          std::fabs(camera.cy - 0.5 * (camera.height - 1)) < kNothing_px &&
          std::fabs(camera.fx - camera.fy) * std::max(camera.width, camera.height) < kNothing_px * camera.fx);
}

}  // namespace

double PinholeView::horizontal_fov_rad() const { return 2 * std::atan2(0.5 * width, fx); }

PinholeView pinhole_view(const Camera& camera, const PixelRays& rays, Pinhole which) {
  PinholeView view;
  view.camera_width_ = camera.width;
  view.looked_up = !is_drawn(camera, which);
  if (!view.looked_up) {
    view.width = camera.width, view.height = camera.height;
    view.fx = camera.fx, view.fy = camera.fy, view.cx = camera.cx, view.cy = camera.cy;
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
  if (which == Pinhole::centred) {
    right = std::max(-left, right), left = -right;
    bottom = std::max(-top, bottom), top = -bottom;
  }
  const double focal = 1 / finest;  // px: nowhere coarser than the camera's pixels
  const double width = focal * (right - left) + 2 * kMargin + 1, height = focal * (bottom - top) + 2 * kMargin + 1;
  constexpr double kLargest = 32768;
  if (!(width < kLargest && height < kLargest)) {
    throw UserError("the field of view is too wide for a pinhole image (" + std::to_string(std::lround(width)) + " x " +
                    std::to_string(std::lround(height)) + " pixels would be needed)");
  }
  view.width = static_cast<int>(std::ceil(width)), view.height = static_cast<int>(std::ceil(height));
  const bool centred = which == Pinhole::centred;
  const double cx = centred ? 0.5 * (view.width - 1) : kMargin - focal * left;
  const double cy = centred ? 0.5 * (view.height - 1) : kMargin - focal * top;
  view.fx = view.fy = focal, view.cx = cx, view.cy = cy;
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
  if (!looked_up) return tile;
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

}  // namespace esim::inline render
