#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "esim/core/image.h"
#include "esim/preview/colours.h"

namespace esim::inline preview {

enum class Align { left, centre, right };

/// A position on a canvas, px.
struct Spot {
  double x = 0, y = 0;
};

/// A colour image to draw figures on, with clipping.
class Canvas {
 public:
  Canvas(int width, int height, Rgb background) : pixels_(width, height, background) {}
  explicit Canvas(Image<Rgb> pixels) : pixels_(std::move(pixels)) {}

  const Image<Rgb>& pixels() const { return pixels_; }
  Image<Rgb> take() && { return std::move(pixels_); }

  void draw(const Image<Rgb>& image, int x, int y);
  void fill(const Tile& area, Rgb colour);
  void outline(const Tile& area, Rgb colour);

  /// An antialiased line through points (columns and rows; pixel centres are integers).
  void polyline(std::span<const Spot> points, double width, Rgb colour);
  void disc(Spot centre, double radius, Rgb colour);

  /// One line of ASCII text; capitals are `height` px tall and stand on `baseline`. Returns its width.
  int text(int x, int baseline, std::string_view line, int height, Rgb colour, Align align = Align::left);

  /// The width of the same line drawn by text().
  static int text_width(std::string_view line, int height);

 private:
  Image<Rgb> pixels_;
};

/// Mean over the source pixels that each target pixel covers; the target must not be larger than the source.
Image<float> reduce_mean(const Image<float>& image, int width, int height);

/// The source pixel nearest to the centre of each target pixel; without interpolation, so that edges and infinities
/// remain.
Image<float> reduce_nearest(const Image<float>& image, int width, int height);

/// Encodes an 8-bit colour PNG file.
std::string encode_png(const Image<Rgb>& image);

/// Enlarges by repeating pixels; with fractional factors, borders between pixels are blended.
Image<Rgb> enlarge(const Image<Rgb>& image, int width, int height);

}  // namespace esim::inline preview
