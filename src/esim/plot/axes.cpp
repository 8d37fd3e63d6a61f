#include "esim/plot/axes.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "esim/plot/tick_layout.h"

namespace esim::inline plot {
namespace {

// Distances in px.
constexpr int kTick = 5, kMinorTick = 3, kLabelGap = 5, kTitleGap = 12, kEdge = 6, kDescent = 4;
constexpr int kMinRight = 12, kTitleRow = kTitleHeight + 16;

/// The title with the factor and the offset of the labels.
std::string full_title(const Scale& scale, const Ticks& ticks) {
  std::string title = scale.title;
  if (!ticks.factor.empty()) title += "  " + ticks.factor;
  if (!ticks.offset.empty()) title += std::string("  ") + (ticks.offset.starts_with("−") ? "" : "+") + ticks.offset;
  return title;
}

int widest_label(const Ticks& ticks) {
  int widest = 0;
  for (const Tick& tick : ticks.major) widest = std::max(widest, Canvas::text_width(tick.label, kTextHeight));
  return widest;
}

}  // namespace

Axes::Axes(Canvas& canvas, const Tile& cell, Scale x, Scale y, AxesOptions options)
    : canvas_(canvas), x_(std::move(x)), y_(std::move(y)), options_(std::move(options)) {
  lay_out(cell);
  draw_titles(cell);
  draw_grid();
}

void Axes::lay_out(const Tile& cell) {
  const bool has_title = !options_.title.empty(), has_legend = !options_.legend.empty();
  lay_out_rows(cell, has_title || has_legend ? kEdge + kTitleRow : kEdge + kTextHeight / 2);
  lay_out_columns(cell);
  const int needed = Canvas::text_width(options_.title, kTitleHeight) + 2 * kTextHeight + legend_width(options_.legend);
  if (has_title && has_legend && needed > area_.width) {
    lay_out_rows(cell, kEdge + kTitleRow + kLegendLine);
    lay_out_columns(cell);
  }
}

/// The right end of the diagram, and the labels below it.
void Axes::lay_out_columns(const Tile& cell) {
  const int left = area_.x - cell.x;
  int right = kMinRight;
  for (int attempt = 0; attempt < 2; ++attempt) {
    area_.width = std::max(1, cell.width - left - right);
    x_ticks_ = ticks_that_fit(x_, area_.width, Direction::horizontal);
    if (x_ticks_.major.empty()) break;
    const Tick& last = x_ticks_.major.back();
    const int beyond =
        column(last.value) + (Canvas::text_width(last.label, kTextHeight) + 1) / 2 - (cell.x + cell.width);
    if (beyond <= 0) break;
    right += beyond;
  }
}

/// The rows of the diagram, which begin `top` px below the edge of the cell; the labels in them; and its left end.
void Axes::lay_out_rows(const Tile& cell, int top) {
  const int bottom = kTick + kLabelGap + kTextHeight + (x_.title.empty() ? 0 : kTitleGap + kTextHeight) + kDescent;
  area_.y = cell.y + top;
  area_.height = std::max(1, cell.height - top - bottom);
  y_ticks_ = ticks_that_fit(y_, area_.height, Direction::vertical);
  const int title = y_.title.empty() ? 0 : kTextHeight + kTitleGap;
  area_.x = cell.x + std::max(options_.min_left, kEdge + title + widest_label(y_ticks_) + kLabelGap + kTick);
}

void Axes::draw_titles(const Tile& cell) {
  const Theme& theme = options_.theme;
  const int baseline = cell.y + kEdge + kTitleHeight, right = area_.x + area_.width;
  canvas_.text(area_.x, baseline, options_.title, Canvas::fitting_height(options_.title, kTitleHeight, right - area_.x),
               theme.ink);
  if (!options_.legend.empty()) {
    const int width = legend_width(options_.legend);
    const bool below = area_.y > cell.y + kEdge + kTitleRow;
    draw_legend_row(canvas_, below ? area_.x : std::max(area_.x, right - width), below ? area_.y - 10 : baseline,
                    options_.legend, theme);
  }
  // In the middle of the axis, or as close to it as the cell allows.
  const auto middle = [](int wanted, int width, int first, int extent) {
    return std::max(std::min(wanted, first + extent - (width + 1) / 2), first + width / 2);
  };
  const std::string y_title = full_title(y_, y_ticks_), x_title = full_title(x_, x_ticks_);
  const int y_height = Canvas::fitting_height(y_title, kTextHeight, cell.height);
  const int x_height = Canvas::fitting_height(x_title, kTextHeight, cell.width);
  canvas_.clip(cell);
  canvas_.vertical_text(cell.x + kEdge + kTextHeight,
                        middle(area_.y + area_.height / 2, Canvas::text_width(y_title, y_height), cell.y, cell.height),
                        y_title, y_height, theme.ink, Align::centre);
  canvas_.text(middle(area_.x + area_.width / 2, Canvas::text_width(x_title, x_height), cell.x, cell.width),
               area_.y + area_.height + kTick + kLabelGap + 2 * kTextHeight + kTitleGap, x_title, x_height, theme.ink,
               Align::centre);
  canvas_.unclip();
}

void Axes::draw_grid() {
  const Theme& theme = options_.theme;
  if (x_.names.empty()) {
    for (const Tick& tick : x_ticks_.major) canvas_.fill({column(tick.value), area_.y, 1, area_.height}, theme.grid);
  }
  if (y_.names.empty()) {
    for (const Tick& tick : y_ticks_.major) canvas_.fill({area_.x, row(tick.value), area_.width, 1}, theme.grid);
  }
}

Spot Axes::spot(const DataPoint& point) const {
  return {area_.x + x_.position(point.x) * (area_.width - 1),
          area_.y + (1 - y_.position(point.y)) * (area_.height - 1)};
}

int Axes::column(double x) const {
  return area_.x + static_cast<int>(std::lround(std::clamp(x_.position(x), 0.0, 1.0) * (area_.width - 1)));
}

int Axes::row(double y) const {
  return area_.y + static_cast<int>(std::lround((1 - std::clamp(y_.position(y), 0.0, 1.0)) * (area_.height - 1)));
}

void Axes::fill(double x0, double x1, double y0, double y1, Rgb colour) {
  const int left = column(x0), right = std::max(left + 1, column(x1));
  const int top = row(y1), bottom = row(y0);
  canvas_.fill({left, top, right - left, bottom - top}, colour);
}

void Axes::horizontal_line(double y, Rgb colour) { canvas_.fill({area_.x, row(y), area_.width, 1}, colour); }

void Axes::line(std::span<const DataPoint> points, Rgb colour, double width) {
  std::vector<Spot> spots;
  for (const DataPoint& point : points) spots.push_back(spot(point));
  canvas_.clip(area_);
  canvas_.polyline(spots, width, colour);
  canvas_.unclip();
}

void Axes::dot(const DataPoint& point, double radius, Rgb colour) {
  canvas_.clip(area_);
  canvas_.disc(spot(point), radius, colour);
  canvas_.unclip();
}

void Axes::vertical_line(double x, const std::string& label, Rgb colour) {
  canvas_.fill({column(x), area_.y, 1, area_.height}, colour);
  line_labels_.push_back({column(x), label, colour});
}

void Axes::draw_over_data(int x, int baseline, const std::string& text, Rgb colour) {
  constexpr int kAround = 3;
  canvas_.fill({x - kAround, baseline - kTextHeight - kAround, Canvas::text_width(text, kTextHeight) + 2 * kAround,
                kTextHeight + kDescent + 2 * kAround},
               options_.theme.page);
  canvas_.text(x, baseline, text, kTextHeight, colour);
}

void Axes::note(const std::string& text, Rgb colour) {
  draw_over_data(area_.x + kTitleGap, area_.y + kTitleGap + kTextHeight, text, colour);
}

/// Each to the right of its line, or to the left at the right end; below those that it would overlap.
void Axes::draw_line_labels() {
  constexpr int kGap = 6, kRow = 2 * kTextHeight;
  std::vector<std::vector<std::pair<int, int>>> rows;  // the columns that are taken in each row
  for (const LineLabel& label : line_labels_) {
    const int width = Canvas::text_width(label.text, kTextHeight);
    int x = label.column + kGap;
    if (x + width + kGap > area_.x + area_.width) x = label.column - kGap - width;
    const auto is_free = [&](const std::vector<std::pair<int, int>>& taken) {
      return std::none_of(taken.begin(), taken.end(),
                          [&](const auto& other) { return x - kGap < other.second && other.first < x + width + kGap; });
    };
    const auto free_row = std::find_if(rows.begin(), rows.end(), is_free);
    const auto index = free_row - rows.begin();
    if (free_row == rows.end()) rows.emplace_back();
    rows[static_cast<std::size_t>(index)].push_back({x, x + width});
    draw_over_data(x, area_.y + kGap + kTextHeight + static_cast<int>(index) * kRow, label.text, label.colour);
  }
}

void Axes::finish() {
  const Theme& theme = options_.theme;
  draw_line_labels();
  canvas_.outline({area_.x - 1, area_.y - 1, area_.width + 2, area_.height + 2}, theme.faint_ink);
  const int bottom = area_.y + area_.height;
  for (const double value : x_ticks_.minor) canvas_.fill({column(value), bottom, 1, kMinorTick}, theme.faint_ink);
  for (const double value : y_ticks_.minor)
    canvas_.fill({area_.x - kMinorTick, row(value), kMinorTick, 1}, theme.faint_ink);
  for (const Tick& tick : x_ticks_.major) {
    canvas_.fill({column(tick.value), bottom, 1, kTick}, theme.faint_ink);
    canvas_.text(column(tick.value), bottom + kTick + kLabelGap + kTextHeight, tick.label, kTextHeight, theme.ink,
                 Align::centre);
  }
  for (const Tick& tick : y_ticks_.major) {
    canvas_.fill({area_.x - kTick, row(tick.value), kTick, 1}, theme.faint_ink);
    canvas_.text(area_.x - kTick - kLabelGap, row(tick.value) + kTextHeight / 2, tick.label, kTextHeight, theme.ink,
                 Align::right);
  }
}

}  // namespace esim::inline plot
