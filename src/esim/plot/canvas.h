#pragma once

#include <array>
#include <span>
#include <string_view>
#include <utility>

#include "esim/core/image.h"
#include "esim/plot/colour.h"

namespace esim::inline plot {

enum class Align { left, centre, right };

/// A position on a canvas, px; pixel centres are integers.
struct Spot {
  double x = 0, y = 0;
};

/// A line from one position to another.
using Stroke = std::array<Spot, 2>;

/// A colour image to draw on. Drawing is clipped to the image, and to clip().
class Canvas {
 public:
  Canvas(int width, int height, Rgb background) : Canvas(Image<Rgb>(width, height, background)) {}
  explicit Canvas(Image<Rgb> pixels) : pixels_(std::move(pixels)), clip_(pixels_.bounds()) {}

  const Image<Rgb>& pixels() const { return pixels_; }
  Image<Rgb> take() && { return std::move(pixels_); }

  /// Clips the following drawing to `area`.
  void clip(const Tile& area);
  void unclip() { clip_ = pixels_.bounds(); }

  void draw(const Image<Rgb>& image, int x, int y);
  void fill(const Tile& area, Rgb colour);
  void outline(const Tile& area, Rgb colour);

  /// An antialiased line through points. Points that are not finite interrupt it.
  void polyline(std::span<const Spot> points, double width, Rgb colour);
  void strokes(std::span<const Stroke> lines, double width, Rgb colour);
  void disc(Spot centre, double radius, Rgb colour);

  /// One line of UTF-8 text; capitals are `height` px tall and stand on `baseline`. Returns its width.
  int text(int x, int baseline, std::string_view line, int height, Rgb colour, Align align = Align::left);

  /// The same, from the bottom to the top, beginning at `y`; it stands on the column `baseline`.
  void vertical_text(int baseline, int y, std::string_view line, int height, Rgb colour, Align align = Align::left);

  /// The width of the same line drawn by text().
  static int text_width(std::string_view line, int height);

  /// The largest height up to `height`, and at least 6, at which the line is at most `width` px wide.
  static int fitting_height(std::string_view line, int height, int width);

 private:
  void blend(const Image<std::uint8_t>& coverage, int x, int y, Rgb colour);

  Image<Rgb> pixels_;
  Tile clip_;
};

}  // namespace esim::inline plot
