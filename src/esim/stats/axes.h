#pragma once

#include <span>
#include <string>
#include <vector>

#include "esim/record/preview/canvas.h"

namespace esim {

// Colours of figures.
inline constexpr Rgb kPaper{255, 255, 255};
inline constexpr Rgb kInk{30, 30, 30};
inline constexpr Rgb kFaintInk{110, 110, 110};
inline constexpr Rgb kGrid{228, 228, 228};
inline constexpr Rgb kBarColour{86, 112, 138};
inline constexpr Rgb kAlarmColour{208, 32, 52};

struct Tick {
  double value = 0;
  std::string label;
};

/// One axis of a diagram: values from low to high, evenly spaced or, if logarithmic, in their logarithm.
struct Scale {
  double low = 0, high = 1;  ///< low < high; for logarithms above 0
  bool logarithmic = false;
  std::vector<Tick> ticks;
  std::string title;  ///< what it is, with the unit

  /// 0 at low, 1 at high; beyond them outside.
  double position(double value) const;
};

/// With about five ticks at round numbers; of magnitudes only, if `absolute`.
Scale linear_scale(double low, double high, std::string title, bool absolute = false);

/// With a tick at each power of ten, and at 2 and 5 times it where these are few: 0.1, 1, 10, 100, 1k ... or, in
/// `seconds`, 1 us, 10 us ...
Scale decade_scale(double low, double high, std::string title, bool seconds = false);

/// A pair of values in a diagram.
struct DataPoint {
  double x = 0, y = 0;
};

/// A diagram with two axes on a part of a canvas. What is drawn beyond them is cut off.
class Axes {
 public:
  /// Draws title and grid. `area` is that of the diagram alone: titles and labels stand around it, within 66 px to
  /// the left, 46 px above and 44 px below.
  Axes(Canvas& canvas, const Tile& area, const std::string& title, Scale x, Scale y);

  void fill(double x0, double x1, double y0, double y1, Rgb colour);
  void horizontal_line(double y, Rgb colour);
  void line(std::span<const DataPoint> points, Rgb colour, double width = 2);
  void dot(const DataPoint& point, double radius, Rgb colour);
  /// Text that begins at a place, to be read above the data.
  void label(const DataPoint& point, const std::string& text, Rgb colour);
  /// With a label at the top.
  void vertical_line(double x, const std::string& label, Rgb colour);

  /// Draws what lies above the data: frame and tick labels.
  void finish();

 private:
  Spot spot(const DataPoint& point) const;
  int column(double x) const;
  int row(double y) const;

  Canvas& canvas_;
  Tile area_;
  Scale x_, y_;
};

}  // namespace esim
