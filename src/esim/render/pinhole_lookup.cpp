#include "esim/render/pinhole_lookup.h"

#include <hwy/highway.h>

#include <algorithm>
#include <limits>

namespace esim::inline render {
namespace {

template <typename T>
void copy(const Image<T>& from, const Tile& tile, Image<T>& to) {
  for (int y = tile.y; y < tile.y + tile.height; ++y) std::copy_n(from.row(y) + tile.x, tile.width, to.row(y) + tile.x);
}

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using Ints = hn::RebindToSigned<Floats>;
using Vector = hn::Vec<Floats>;
using IntVector = hn::Vec<Ints>;

constexpr std::size_t kMaxLanes = hn::MaxLanes(Floats());

/// The pixel to the left of and above an image position, clamped to at least `margin` pixels from the far borders.
struct Place {
  IntVector x, y, index;

  Place(const Image<float>& image, IntVector column, IntVector row, int first, int margin) {
    const Ints d;
    x = hn::Min(hn::Max(column, hn::Set(d, first)), hn::Set(d, image.width() - margin));
    y = hn::Min(hn::Max(row, hn::Set(d, first)), hn::Set(d, image.height() - margin));
    index = hn::Add(hn::Mul(y, hn::Set(d, image.width())), x);
  }

  Vector value(const Image<float>& image, int right, int down) const {
    return hn::GatherIndex(Floats(), image.data() + right + down * image.width(), index);
  }
};

/// Bilinear interpolation between the four pixels around a position.
Vector interpolate(const Image<float>& image, Vector x, Vector y) {
  const Place place(image, hn::ConvertTo(Ints(), x), hn::ConvertTo(Ints(), y), 0, 2);
  const Vector fx = hn::Sub(x, hn::ConvertTo(Floats(), place.x)), fy = hn::Sub(y, hn::ConvertTo(Floats(), place.y));
  const auto between = [&](int down) {
    const Vector left = place.value(image, 0, down);
    return hn::MulAdd(fx, hn::Sub(place.value(image, 1, down), left), left);
  };
  const Vector above = between(0);
  return hn::MulAdd(fy, hn::Sub(between(1), above), above);
}

Vector inverse(Vector v) { return hn::Div(hn::Set(Floats(), 1.0F), v); }

/// Slope of 1 / Z along a direction, from the neighbour that more likely lies on the same surface.
Vector slope(const Image<float>& depth, const Place& place, Vector here, int dx, int dy) {
  const Vector before = hn::Sub(here, inverse(place.value(depth, -dx, -dy)));
  const Vector after = hn::Sub(inverse(place.value(depth, dx, dy)), here);
  return hn::IfThenElse(hn::Lt(hn::Abs(before), hn::Abs(after)), before, after);
}

constexpr float kHalf = 0.5F;  // added before truncation, so that it rounds

// For as many pixels as a vector has lanes. Not inlined, so that all pixels go through the same instructions, also at
// the end of a row, and tiles are identical to full images.

/// E.
HWY_NOINLINE void light_of_vector(const Image<float>& image, const float* centres, const float* footprints,
                                  float* irradiance) {
  const Floats d;
  Vector cx, cy, right_x, down_x, right_y, down_y;
  hn::LoadInterleaved2(d, centres, cx, cy);
  hn::LoadInterleaved4(d, footprints, right_x, down_x, right_y, down_y);
  Vector sum = hn::Zero(d);
  for (const float a : {-0.25F, 0.25F}) {
    for (const float b : {-0.25F, 0.25F}) {
      const Vector right = hn::Set(d, a), down = hn::Set(d, b);
      sum = hn::Add(sum, interpolate(image, hn::MulAdd(right, right_x, hn::MulAdd(down, down_x, cx)),
                                     hn::MulAdd(right, right_y, hn::MulAdd(down, down_y, cy))));
    }
  }
  hn::StoreU(hn::Mul(hn::Set(d, 0.25F), sum), d, irradiance);
}

/// Z.
HWY_NOINLINE void depth_of_vector(const Image<float>& image, const float* centres, float* depth) {
  const Floats d;
  Vector cx, cy;
  hn::LoadInterleaved2(d, centres, cx, cy);
  const Vector half = hn::Set(d, kHalf);
  const Place place(image, hn::ConvertTo(Ints(), hn::Add(cx, half)), hn::ConvertTo(Ints(), hn::Add(cy, half)), 1, 2);
  const Vector here = inverse(place.value(image, 0, 0));
  const Vector along_x = hn::Mul(hn::Sub(cx, hn::ConvertTo(d, place.x)), slope(image, place, here, 1, 0));
  const Vector along_y = hn::Mul(hn::Sub(cy, hn::ConvertTo(d, place.y)), slope(image, place, here, 0, 1));
  const Vector nearest = hn::Add(here, hn::Add(along_x, along_y));
  const Vector nothing = hn::Set(d, std::numeric_limits<float>::infinity());
  hn::StoreU(hn::IfThenElse(hn::Gt(nearest, hn::Zero(d)), inverse(nearest), nothing), d, depth);
}

/// Calls look_up(centres, footprints, out) for each vector of pixels of a tile. The last pixels of a row are copied to
/// and from full vectors.
template <typename LookUp>
void for_each_vector(const PinholeView& view, const Tile& tile, Image<float>& out, const LookUp& look_up) {
  const std::size_t lanes = hn::Lanes(Floats()), width = static_cast<std::size_t>(tile.width);
  for (int y = tile.y; y < tile.y + tile.height; ++y) {
    float* const to = out.row(y) + tile.x;
    const auto first = static_cast<std::size_t>(to - out.data());
    for (std::size_t x = 0; x < width; x += lanes) {
      const float *const centres = &view.centres[2 * (first + x)], *const footprints =
                                                                       &view.footprints[4 * (first + x)];
      if (x + lanes <= width) {
        look_up(centres, footprints, to + x);
        continue;
      }
      const std::size_t count = width - x;
      float own_centres[2 * kMaxLanes] = {}, own_footprints[4 * kMaxLanes] = {}, own[kMaxLanes];
      std::copy_n(centres, 2 * count, own_centres);
      std::copy_n(footprints, 4 * count, own_footprints);
      look_up(own_centres, own_footprints, own);
      std::copy_n(own, count, to + x);
    }
  }
}

void look_up_objects(const PinholeView& view, const PinholeImage& image, const Tile& tile,
                     Image<std::uint16_t>& object) {
  for (int y = tile.y; y < tile.y + tile.height; ++y) {
    std::uint16_t* const to = object.row(y) + tile.x;
    const float* const centres = &view.centres[2 * static_cast<std::size_t>(to - object.data())];
    for (int k = 0; k < tile.width; ++k) {
      const int i = std::clamp(static_cast<int>(centres[2 * k] + kHalf), 1, image.depth.width() - 2);
      const int j = std::clamp(static_cast<int>(centres[2 * k + 1] + kHalf), 1, image.depth.height() - 2);
      to[k] = image.object(i, j);
    }
  }
}

}  // namespace

void look_up_light(const PinholeView& view, const PinholeImage& image, const Tile& tile, Sample& sample) {
  if (!view.looked_up) return copy(image.irradiance, tile, sample.irradiance);
  for_each_vector(view, tile, sample.irradiance, [&](const float* centres, const float* footprints, float* irradiance) {
    light_of_vector(image.irradiance, centres, footprints, irradiance);
  });
}

void look_up_geometry(const PinholeView& view, const PinholeImage& image, const Tile& tile, Sample& sample) {
  const bool with_objects = !sample.object.empty() && !image.object.empty();
  if (!view.looked_up) {
    copy(image.depth, tile, sample.depth);
    if (with_objects) copy(image.object, tile, sample.object);
    return;
  }
  for_each_vector(view, tile, sample.depth, [&](const float* centres, const float*, float* depth) {
    depth_of_vector(image.depth, centres, depth);
  });
  if (with_objects) look_up_objects(view, image, tile, sample.object);
}

}  // namespace esim::inline render
