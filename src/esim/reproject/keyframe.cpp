#include "esim/reproject/keyframe.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>

#include "esim/core/error.h"
#include "esim/reproject/spline_coefficients.h"

namespace esim::inline reproject {
namespace {

/// Mean over the s x s pixels that begin at each pixel.
Image<float> box_mean(const Image<float>& in, int s, const Workers& workers) {
  const int width = in.width(), height = in.height();
  Image<float> out(width, height);
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
  return out;
}

/// Adds a border of one pixel, which mirrors the image at the centres of its outer pixels.
Image<float> with_border(const Image<float>& in, const Workers& workers) {
  Image<float> out(in.width() + 2, in.height() + 2);
  workers.for_each(out.height(), [&](int y) {
    const auto mirrored = [](int i, int count) { return std::abs(count - 1 - std::abs(count - 1 - (i - 1))); };
    const float* const from = in.row(mirrored(y, in.height()));
    float* const to = out.row(y);
    std::copy_n(from, in.width(), to + 1);
    to[0] = from[1], to[in.width() + 1] = from[in.width() - 2];
  });
  return out;
}

/// Computes the spline through the square roots of an image of E.
void to_root(Image<float>& light, const Workers& workers) {
  workers.for_each(light.height(), [&](int y) {
    float* const row = light.row(y);
    for (int x = 0; x < light.width(); ++x) {
      const bool is_number = row[x] >= 0 && row[x] <= std::numeric_limits<float>::max();
      row[x] = is_number ? std::sqrt(row[x]) : 0.0F;
    }
  });
  to_spline_coefficients(light, workers);
  light = with_border(light, workers);
}

/// Computes everything that follows from depth.
void find_surfaces(const KeyframeLayout& layout, const PixelRays& rays, const SceneParts& parts, const Sample& sample,
                   const Workers& workers, Keyframe& keyframe) {
  const Image<std::uint16_t> seen = parts.seen(sample);
  const Surfaces surfaces(sample.depth, layout.camera.fx, workers);
  const int width = layout.camera.width, height = layout.camera.height, s = layout.supersampling;
  keyframe.sparse = keyframe.dense = {};
  for (int y = layout.first(); y < height; y += s)
    for (int x = layout.first(); x < width; x += s) surfaces.add_point(rays, seen, Edge::none, x, y, keyframe.sparse);
  keyframe.deforming = parts.deforming(seen.pixels());
  // Within this distance of an edge, the mean over a sensor pixel contains both sides of the edge.
  keyframe.wide.front = surfaces.front(s / 2 + 1);
  if (keyframe.narrow.root.empty()) return;
  keyframe.narrow.front = surfaces.front(1);
  const Image<Edge> edges = surfaces.edges();
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (edges(x, y) != Edge::none || (x % 2 == 0 && y % 2 == 0))
        surfaces.add_point(rays, seen, edges(x, y), x, y, keyframe.dense);
}

}  // namespace

Camera denser(const Camera& sensor, int s, int margin) {
  Camera camera = sensor;
  camera.width = s * (sensor.width + 2 * margin);
  camera.height = s * (sensor.height + 2 * margin);
  camera.fx = s * sensor.fx;
  camera.fy = s * sensor.fy;
  camera.cx = s * (sensor.cx + margin + 0.5) - 0.5;
  camera.cy = s * (sensor.cy + margin + 0.5) - 0.5;
  return camera;
}

KeyframeLayout lay_out_keyframes(const Camera& sensor, int supersampling, int margin_px) {
  KeyframeLayout layout{sensor, supersampling, margin_px, denser(sensor, supersampling, margin_px)};
  while (layout.margin_px > 0) {
    try {
      layout.camera.validate();
      break;
    } catch (const UserError&) {  // the lens cannot be inverted within this margin
      layout.camera = denser(sensor, supersampling, --layout.margin_px);
    }
  }
  return layout;
}

void prepare_keyframe(const KeyframeLayout& layout, const PixelRays& rays, const SceneParts& parts, bool at_infinity,
                      RenderRequest view, const Sample& sample, KeyframeLight light, const Workers& workers,
                      Keyframe& keyframe) {
  keyframe.view = std::move(view);
  keyframe.wide.offset = light.wide.empty() ? 0.5F * static_cast<float>(layout.supersampling - 1) : 0.0F;
  if (light.wide.empty()) light.wide = box_mean(light.narrow, layout.supersampling, workers);
  keyframe.wide.root = std::move(light.wide);
  if (light.look_closely) keyframe.narrow.root = std::move(light.narrow);
  to_root(keyframe.wide.root, workers);
  if (at_infinity) return;
  if (!keyframe.narrow.root.empty()) to_root(keyframe.narrow.root, workers);
  find_surfaces(layout, rays, parts, sample, workers, keyframe);
}

}  // namespace esim::inline reproject
