#pragma once

#include <span>
#include <string>
#include <vector>

#include "esim/preview/canvas.h"

namespace esim::inline stats {

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
  double low = 0, high = 1;  ///< low < high; above 0 if logarithmic
  bool logarithmic = false;
  std::vector<Tick> ticks;
  std::string title;  ///< quantity and unit

  /// 0 at low, 1 at high; outside [0, 1] beyond them.
  double position(double value) const;
};

/// A scale with about five ticks at round numbers; labelled with magnitudes if `absolute`.
Scale linear_scale(double low, double high, std::string title, bool absolute = false);

/// A scale with a tick at each power of ten, and, if these are few, at 2 and 5 times each: 0.1, 1, 10, 100, 1k ... or,
/// in `seconds`, 1 us, 10 us ...
Scale decade_scale(double low, double high, std::string title, bool seconds = false);

/// A pair of values in a diagram.
struct DataPoint {
  double x = 0, y = 0;
};

/// A diagram with two axes on a part of a canvas. Drawing is clipped to the axes.
class Axes {
 public:
  /// Draws title and grid. `area` is that of the diagram alone: titles and labels need 66 px to the left, 46 px above
  /// and 44 px below.
  Axes(Canvas& canvas, const Tile& area, const std::string& title, Scale x, Scale y);

  void fill(double x0, double x1, double y0, double y1, Rgb colour);
  void horizontal_line(double y, Rgb colour);
  void line(std::span<const DataPoint> points, Rgb colour, double width = 2);
  void dot(const DataPoint& point, double radius, Rgb colour);
  /// Text that begins at `point`, drawn over the data.
  void label(const DataPoint& point, const std::string& text, Rgb colour);
  /// A vertical line with a label at the top.
  void vertical_line(double x, const std::string& label, Rgb colour);

  /// Draws frame and tick labels over the data.
  void finish();

 private:
  Spot spot(const DataPoint& point) const;
  int column(double x) const;
  int row(double y) const;

  Canvas& canvas_;
  Tile area_;
  Scale x_, y_;
};

}  // namespace esim::inline stats
