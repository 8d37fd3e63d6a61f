#include "esim/preview/yuv.h"

#include <vector>

namespace esim::inline preview {
namespace {

// Weights of red, green and blue in 1/65536; their sum is 219/255 for luma and zero for chroma.
constexpr int kBits = 16;
constexpr int kHalf = 1 << (kBits - 1);

std::uint8_t luma(int red, int green, int blue) {
  return static_cast<std::uint8_t>((16829 * red + 33039 * green + 6416 * blue + (16 << kBits) + kHalf) >> kBits);
}

/// `sum` is the sum of four pixels.
std::uint8_t chroma(int sum) {
  return static_cast<std::uint8_t>((sum + (128 << (kBits + 2)) + 4 * kHalf) >> (kBits + 2));
}

/// A row of an image, stored by colour component: loops over these compile to SIMD code, unlike loops over pixels of
/// three bytes.
class ColourRow {
 public:
  explicit ColourRow(int width) : width_(static_cast<std::size_t>(width)), bytes_(3 * width_) {}

  void take(const Rgb* row) {
    std::uint8_t *const r = bytes_.data(), *const g = r + width_, *const b = g + width_;
    for (std::size_t x = 0; x < width_; ++x) r[x] = row[x].r, g[x] = row[x].g, b[x] = row[x].b;
  }

  const std::uint8_t* red() const { return bytes_.data(); }
  const std::uint8_t* green() const { return bytes_.data() + width_; }
  const std::uint8_t* blue() const { return bytes_.data() + 2 * width_; }

 private:
  std::size_t width_;
  std::vector<std::uint8_t> bytes_;
};

void write_luma(const ColourRow& row, int width, std::uint8_t* out) {
  const std::uint8_t *const r = row.red(), *const g = row.green(), *const b = row.blue();
  for (int x = 0; x < width; ++x) out[x] = luma(r[x], g[x], b[x]);
}

void write_chroma(const ColourRow& above, const ColourRow& below, int width, std::uint8_t* u, std::uint8_t* v) {
  const auto sum = [](const std::uint8_t* a, const std::uint8_t* b, int x) {
    return a[2 * x] + a[2 * x + 1] + b[2 * x] + b[2 * x + 1];
  };
  for (int x = 0; x < width / 2; ++x) {
    const int red = sum(above.red(), below.red(), x), green = sum(above.green(), below.green(), x);
    const int blue = sum(above.blue(), below.blue(), x);
    u[x] = chroma(-9714 * red - 19070 * green + 28784 * blue);
    v[x] = chroma(28784 * red - 24103 * green - 4681 * blue);
  }
}

}  // namespace

void to_yuv420(const Image<Rgb>& image, BytePlane y, BytePlane u, BytePlane v) {
  const int width = image.width();
  ColourRow above(width), below(width);
  for (int row = 0; row + 1 < image.height(); row += 2) {
    above.take(image.row(row));
    below.take(image.row(row + 1));
    write_luma(above, width, y.data + row * y.stride);
    write_luma(below, width, y.data + (row + 1) * y.stride);
    write_chroma(above, below, width, u.data + row / 2 * u.stride, v.data + row / 2 * v.stride);
  }
}

}  // namespace esim::inline preview
