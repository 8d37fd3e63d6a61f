#include "esim/render/pinhole_lookup.h"

#include <hwy/highway.h>

#include <algorithm>
#include <limits>

namespace esim {
namespace {

void copy(const PinholeImage& image, const Tile& tile, Sample& sample) {
  const int end = tile.x + tile.width;
  for (int y = tile.y; y < tile.y + tile.height; ++y) {
    const auto copy_row = [&](const auto& from, auto& to) {
      std::copy(from.row(y) + tile.x, from.row(y) + end, to.row(y) + tile.x);
    };
    copy_row(image.irradiance, sample.irradiance);
    copy_row(image.depth, sample.depth);
    if (!sample.object.empty() && !image.object.empty()) copy_row(image.object, sample.object);
  }
}

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using Ints = hn::RebindToSigned<Floats>;
using Vector = hn::Vec<Floats>;
using IntVector = hn::Vec<Ints>;

constexpr std::size_t kMostLanes = hn::MaxLanes(Floats());

/// Of an image: where the pixel left of and above a place is, within it and `margin` pixels from its far ends.
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

/// Between the four pixels around a place.
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

/// Of nearness, along a direction; of the two sides the one that is more likely on the same surface.
Vector slope(const Image<float>& depth, const Place& place, Vector here, int dx, int dy) {
  const Vector before = hn::Sub(here, inverse(place.value(depth, -dx, -dy)));
  const Vector after = hn::Sub(inverse(place.value(depth, dx, dy)), here);
  return hn::IfThenElse(hn::Lt(hn::Abs(before), hn::Abs(after)), before, after);
}

constexpr float kHalf = 0.5F;  // added, lets cutting off round

/// E and Z of as many pixels as a vector has. Not inlined: all pixels go through the same instructions, whether they
/// stand at the end of a row or not, so that tiles equal whole images.
HWY_NOINLINE void look_up_vector(const PinholeImage& image, const float* centres, const float* footprints,
                                 float* irradiance, float* depth) {
  const Floats d;
  Vector cx, cy, right_x, down_x, right_y, down_y;
  hn::LoadInterleaved2(d, centres, cx, cy);
  hn::LoadInterleaved4(d, footprints, right_x, down_x, right_y, down_y);
  Vector sum = hn::Zero(d);
  for (const float a : {-0.25F, 0.25F}) {
    for (const float b : {-0.25F, 0.25F}) {
      const Vector right = hn::Set(d, a), down = hn::Set(d, b);
      sum = hn::Add(sum, interpolate(image.irradiance, hn::MulAdd(right, right_x, hn::MulAdd(down, down_x, cx)),
                                     hn::MulAdd(right, right_y, hn::MulAdd(down, down_y, cy))));
    }
  }
  hn::StoreU(hn::Mul(hn::Set(d, 0.25F), sum), d, irradiance);

  const Vector half = hn::Set(d, kHalf);
  const Place place(image.depth, hn::ConvertTo(Ints(), hn::Add(cx, half)), hn::ConvertTo(Ints(), hn::Add(cy, half)), 1,
                    2);
  const Vector here = inverse(place.value(image.depth, 0, 0));
  const Vector along_x = hn::Mul(hn::Sub(cx, hn::ConvertTo(d, place.x)), slope(image.depth, place, here, 1, 0));
  const Vector along_y = hn::Mul(hn::Sub(cy, hn::ConvertTo(d, place.y)), slope(image.depth, place, here, 0, 1));
  const Vector nearest = hn::Add(here, hn::Add(along_x, along_y));
  const Vector nothing = hn::Set(d, std::numeric_limits<float>::infinity());
  hn::StoreU(hn::IfThenElse(hn::Gt(nearest, hn::Zero(d)), inverse(nearest), nothing), d, depth);
}

/// Copies what a vector of pixels needs, and back, where fewer are left.
void look_up_rest(const PinholeImage& image, const float* centres, const float* footprints, std::size_t count,
                  float* irradiance, float* depth) {
  float own_centres[2 * kMostLanes] = {}, own_footprints[4 * kMostLanes] = {}, light[kMostLanes], z[kMostLanes];
  std::copy_n(centres, 2 * count, own_centres);
  std::copy_n(footprints, 4 * count, own_footprints);
  look_up_vector(image, own_centres, own_footprints, light, z);
  std::copy_n(light, count, irradiance);
  std::copy_n(z, count, depth);
}

void look_up_objects(const PinholeImage& image, const float* centres, std::size_t count, std::uint16_t* object) {
  for (std::size_t k = 0; k < count; ++k) {
    const int i = std::clamp(static_cast<int>(centres[2 * k] + kHalf), 1, image.depth.width() - 2);
    const int j = std::clamp(static_cast<int>(centres[2 * k + 1] + kHalf), 1, image.depth.height() - 2);
    object[k] = image.object(i, j);
  }
}

}  // namespace

void look_up(const PinholeView& view, const PinholeImage& image, const Tile& tile, Sample& sample) {
  if (!view.looked_up) return copy(image, tile, sample);
  const std::size_t lanes = hn::Lanes(Floats()), width = static_cast<std::size_t>(tile.width);
  for (int y = tile.y; y < tile.y + tile.height; ++y) {
    const auto first =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(sample.depth.width()) + static_cast<std::size_t>(tile.x);
    const float* const centres = &view.centres[2 * first];
    const float* const footprints = &view.footprints[4 * first];
    float *const irradiance = sample.irradiance.row(y) + tile.x, *const depth = sample.depth.row(y) + tile.x;
    std::size_t x = 0;
    for (; x + lanes <= width; x += lanes)
      look_up_vector(image, centres + 2 * x, footprints + 4 * x, irradiance + x, depth + x);
    if (x < width) look_up_rest(image, centres + 2 * x, footprints + 4 * x, width - x, irradiance + x, depth + x);
    if (!sample.object.empty() && !image.object.empty())
      look_up_objects(image, centres, width, sample.object.row(y) + tile.x);
  }
}

}  // namespace esim
