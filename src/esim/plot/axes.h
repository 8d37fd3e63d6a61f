#pragma once

#include <span>
#include <string>
#include <vector>

#include "esim/plot/canvas.h"
#include "esim/plot/legend.h"
#include "esim/plot/scale.h"
#include "esim/plot/theme.h"

namespace esim::inline plot {

/// A pair of values in a diagram.
struct DataPoint {
  double x = 0, y = 0;
};

struct AxesOptions {
  std::string title{};
  std::vector<LegendEntry> legend{};  ///< to the right of the title, or below it
  Theme theme = kLightTheme;
  int min_left = 76;  ///< between the cell's left edge and the diagram, px: the same for diagrams below each other
};

/// A diagram with two axes. Data are clipped to it.
class Axes {
 public:
  /// Draws titles, legend and grid into `cell`, which contains all of them: the diagram itself is smaller.
  Axes(Canvas& canvas, const Tile& cell, Scale x, Scale y, AxesOptions options = {});

  /// The diagram without titles and labels.
  const Tile& area() const { return area_; }
  /// Ticks of the axes; those without space for their labels have none.
  const Ticks& x_ticks() const { return x_ticks_; }
  const Ticks& y_ticks() const { return y_ticks_; }

  void fill(double x0, double x1, double y0, double y1, Rgb colour);
  void horizontal_line(double y, Rgb colour);
  void line(std::span<const DataPoint> points, Rgb colour, double width = 2);
  void dot(const DataPoint& point, double radius, Rgb colour);
  /// A vertical line; finish() labels it at the top of the diagram.
  void vertical_line(double x, const std::string& label, Rgb colour);
  /// Draws a line of text over the data, in the upper left corner.
  void note(const std::string& text, Rgb colour);

  /// Draws frame, tick labels, and labels of lines over the data.
  void finish();

 private:
  struct LineLabel {
    int column;
    std::string text;
    Rgb colour;
  };

  void lay_out(const Tile& cell);
  void lay_out_rows(const Tile& cell, int top);
  void lay_out_columns(const Tile& cell);
  void draw_titles(const Tile& cell);
  void draw_grid();
  void draw_line_labels();
  void draw_over_data(int x, int baseline, const std::string& text, Rgb colour);
  Spot spot(const DataPoint& point) const;
  int column(double x) const;
  int row(double y) const;

  Canvas& canvas_;
  Scale x_, y_;
  AxesOptions options_;
  Tile area_;
  Ticks x_ticks_, y_ticks_;
  std::vector<LineLabel> line_labels_;
};

}  // namespace esim::inline plot
