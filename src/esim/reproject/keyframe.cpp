#include "esim/reproject/keyframe.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "esim/core/error.h"
#include "esim/reproject/spline_coefficients.h"

namespace esim {
namespace {

/// Neighbouring pixels belong to different surfaces where 1/Z differs by more than this share of it from the straight
/// line through their neighbours.
constexpr float kDiscontinuity = 0.01F;

Camera widened(const Camera& sensor, int s, int margin) {
  Camera camera = sensor;
  camera.width = s * (sensor.width + 2 * margin);
  camera.height = s * (sensor.height + 2 * margin);
  camera.fx = s * sensor.fx;
  camera.fy = s * sensor.fy;
  camera.cx = s * (sensor.cx + margin + 0.5) - 0.5;
  camera.cy = s * (sensor.cy + margin + 0.5) - 0.5;
  return camera;
}

/// Mean over the s x s pixels that begin at each pixel.
void box_mean(const Image<float>& in, int s, const Workers& workers, Image<float>& out) {
  const int width = in.width(), height = in.height();
  if (out.bounds() != in.bounds()) out = Image<float>(width, height);
  const float scale = 1.0F / static_cast<float>(s * s);
  workers.for_each(height, [&](int y) {
    float* const to = out.row(y);
    std::fill_n(to, width, 0.0F);
    for (int j = 0; j < s; ++j) {
      const float* const from = in.row(std::min(y + j, height - 1));
      for (int i = 0; i < s; ++i) {
        for (int x = 0; x < width - i; ++x) to[x] += from[x + i];
        for (int x = width - i; x < width; ++x) to[x] += from[width - 1];
      }
    }
    for (int x = 0; x < width; ++x) to[x] *= scale;
  });
}

/// The smaller of the differences to both sides, if that is no discontinuity.
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
      const float z = depth(x, y), w = z > 0 ? 1.0F / z : 0.0F;  // no number: as good as nothing
      nearness(x, y) = w <= std::numeric_limits<float>::max() ? w : 0.0F;
    }
  });
  return nearness;
}

/// Fills in everything that follows from depth.
void find_surfaces(const KeyframeLayout& layout, const Image<float>& w, const Workers& workers, Keyframe& keyframe) {
  const int width = w.width(), height = w.height(), s = layout.supersampling;
  const int reach = s / 2 + 1;  // px from an edge at which the mean over a pixel of the sensor holds both of its sides
  if (keyframe.front.bounds() != w.bounds()) {
    keyframe.front = Image<float>(width, height);
    for (Image<float>* image : {&keyframe.nearness, &keyframe.slope_x, &keyframe.slope_y})
      *image = Image<float>(layout.columns(), layout.rows());
  }
  workers.for_each(height, [&](int y) {
    const int above = std::max(y - 1, 0), below = std::min(y + 1, height - 1);
    for (int x = 0; x < width; ++x) {
      const int left = std::max(x - 1, 0), right = std::min(x + 1, width - 1);
      const float slope_x = slope(w(left, y), w(x, y), w(right, y)), slope_y = slope(w(x, above), w(x, y), w(x, below));
      float nearest = w(x, y);
      for (int j = std::max(y - reach, 0); j <= std::min(y + reach, height - 1); ++j)
        for (int i = std::max(x - reach, 0); i <= std::min(x + reach, width - 1); ++i)
          nearest = std::max(nearest, w(i, j));
      const float ahead = nearest - w(x, y);
      const float smooth = (static_cast<float>(reach) + 0.5F) * (std::fabs(slope_x) + std::fabs(slope_y));
      keyframe.front(x, y) = ahead > smooth + kDiscontinuity * w(x, y) ? nearest : w(x, y);
      const int column = (x - layout.first()) / s, row = (y - layout.first()) / s;
      if (x != layout.first() + s * column || y != layout.first() + s * row) continue;
      keyframe.nearness(column, row) = w(x, y);
      keyframe.slope_x(column, row) = slope_x, keyframe.slope_y(column, row) = slope_y;
    }
  });
}

/// Keeps which object those pixels see that are thrown.
void thin_out(const KeyframeLayout& layout, const Image<std::uint16_t>& object, Image<std::uint16_t>& kept) {
  const int columns = object.empty() ? 0 : layout.columns(), rows = object.empty() ? 0 : layout.rows();
  if (kept.width() != columns || kept.height() != rows) kept = Image<std::uint16_t>(columns, rows);
  const int s = layout.supersampling, first = layout.first();
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) kept(column, row) = object(first + s * column, first + s * row);
}

}  // namespace

KeyframeLayout lay_out_keyframes(const Camera& sensor, int supersampling, int margin_px, bool wide_pixels) {
  KeyframeLayout layout{sensor, supersampling, margin_px, widened(sensor, supersampling, margin_px), wide_pixels};
  while (layout.margin_px > 0) {
    try {
      layout.camera.validate();
      break;
    } catch (const UserError&) {  // the lens ends within this margin
      layout.camera = widened(sensor, supersampling, --layout.margin_px);
    }
  }
  if (wide_pixels) layout.camera.footprint = supersampling * sensor.footprint;
  return layout;
}

void prepare_keyframe(const KeyframeLayout& layout, bool at_infinity, RenderRequest view, Sample& sample,
                      const Workers& workers, Keyframe& keyframe) {
  keyframe.view = std::move(view);
  if (layout.wide_pixels) {
    std::swap(keyframe.root, sample.irradiance);
  } else {
    box_mean(sample.irradiance, layout.supersampling, workers, keyframe.root);
  }
  workers.for_each(keyframe.root.height(), [&](int y) {
    float* const row = keyframe.root.row(y);
    for (int x = 0; x < keyframe.root.width(); ++x) {
      const bool is_number = row[x] >= 0 && row[x] <= std::numeric_limits<float>::max();
      row[x] = is_number ? std::sqrt(row[x]) : 0.0F;
    }
  });
  to_spline_coefficients(keyframe.root, workers);
  if (at_infinity) return;
  find_surfaces(layout, inverse(sample.depth, workers), workers, keyframe);
  thin_out(layout, sample.object, keyframe.object);
}

}  // namespace esim
