#include "esim/record/preview/yuv.h"

namespace esim {
namespace {

// Weights of red, green and blue in 1/65536, which sum up to 219/255 for luma and to nothing for chroma.
constexpr int kBits = 16;
constexpr int kHalf = 1 << (kBits - 1);

std::uint8_t luma(const std::uint8_t* rgb) {
  const int sum = 16829 * rgb[0] + 33039 * rgb[1] + 6416 * rgb[2];
  return static_cast<std::uint8_t>((sum + (16 << kBits) + kHalf) >> kBits);
}

/// `sum`: of four pixels.
std::uint8_t chroma(int sum) {
  return static_cast<std::uint8_t>((sum + (128 << (kBits + 2)) + 4 * kHalf) >> (kBits + 2));
}

}  // namespace

void to_yuv420(const Image<Rgb>& image, BytePlane y, BytePlane u, BytePlane v) {
  const int width = image.width();
  for (int row = 0; row < image.height(); ++row) {
    const auto* const rgb = reinterpret_cast<const std::uint8_t*>(image.row(row));
    std::uint8_t* const out = y.data + row * y.stride;
    for (int x = 0; x < width; ++x) out[x] = luma(rgb + 3 * x);
  }
  for (int row = 0; row < image.height() / 2; ++row) {
    const auto* const above = reinterpret_cast<const std::uint8_t*>(image.row(2 * row));
    const auto* const below = reinterpret_cast<const std::uint8_t*>(image.row(2 * row + 1));
    std::uint8_t* const u_out = u.data + row * u.stride;
    std::uint8_t* const v_out = v.data + row * v.stride;
    for (int x = 0; x < width / 2; ++x) {
      const std::uint8_t *const a = above + 6 * x, *const b = below + 6 * x;
      const int red = a[0] + a[3] + b[0] + b[3], green = a[1] + a[4] + b[1] + b[4], blue = a[2] + a[5] + b[2] + b[5];
      u_out[x] = chroma(-9714 * red - 19070 * green + 28784 * blue);
      v_out[x] = chroma(28784 * red - 24103 * green - 4681 * blue);
    }
  }
}

}  // namespace esim
