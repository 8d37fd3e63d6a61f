#include "esim/compare/comparison_figure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "esim/plot/axes.h"
#include "esim/preview/pictures.h"
#include "esim/represent/representations.h"

namespace esim::inline compare {
namespace {

constexpr int kWidth = 1600, kHeader = 44, kMargin = 16, kRow = 460;
constexpr int kCell = (kWidth - 2 * kMargin) / 3;
constexpr Rgb kFirstColour{36, 84, 160}, kSecondColour{214, 96, 30};

std::vector<DataPoint> cumulative(const IntegerHistogram& histogram, double factor) {
  std::vector<DataPoint> points;
  double below = 0;
  const auto total = static_cast<double>(std::max<std::uint64_t>(1, histogram.total()));
  for (std::size_t i = 0; i < histogram.bins().size(); ++i) {
    if (histogram.bins()[i] == 0) continue;
    points.push_back({factor * static_cast<double>(IntegerHistogram::edge(i)), below / total});
    below += static_cast<double>(histogram.bins()[i]);
    points.push_back({factor * static_cast<double>(IntegerHistogram::edge(i + 1)), below / total});
  }
  return points;
}

IntegerHistogram all_counts(const SensorStatistics& s) {
  IntegerHistogram sum = s.counts_on;
  sum.add(s.counts_off);
  return sum;
}

void draw_cumulative(Canvas& canvas, const Tile& cell, const std::string& title, const Scale& x,
                     const std::vector<DataPoint>& first, const std::vector<DataPoint>& second) {
  Axes axes(canvas, cell, x, linear_scale(0, 1, "cumulative fraction"),
            {title, {{"A", kFirstColour}, {"B", kSecondColour}}});
  axes.line(first, kFirstColour);
  axes.line(second, kSecondColour);
  axes.finish();
}

double last_of(const std::vector<DataPoint>& points, double other) {
  return points.empty() ? other : std::max(other, points.back().x);
}

void draw_intervals(Canvas& canvas, const Tile& cell, const RecordingComparison& c) {
  const std::vector<DataPoint> a = cumulative(c.first.intervals_us, 1e-6), b = cumulative(c.second.intervals_us, 1e-6);
  const double high = std::pow(10, std::ceil(std::log10(std::max(1e-5, last_of(b, last_of(a, 1e-5))))));
  const auto low_of = [](const SensorStatistics& s) {
    return s.intervals_us.total() > 0 ? 1e-6 * s.intervals_us.quantile(0.001) : 1.0;
  };
  const double low =
      std::pow(10, std::floor(std::log10(std::clamp(std::min(low_of(c.first), low_of(c.second)), 1e-6, high / 10))));
  draw_cumulative(canvas, cell, "Time between events of a pixel",
                  logarithmic_scale(low, high, "interval", LabelStyle::seconds), a, b);
}

void draw_counts(Canvas& canvas, const Tile& cell, const RecordingComparison& c) {
  const IntegerHistogram a = all_counts(c.first), b = all_counts(c.second);
  const auto most = [](const IntegerHistogram& counts) { return counts.total() > 0 ? counts.quantile(0.999) : 1.0; };
  draw_cumulative(canvas, cell, "Events of a pixel, ON and OFF",
                  linear_scale(0, std::max({1.0, most(a), most(b)}), "events"), cumulative(a, 1), cumulative(b, 1));
}

void draw_deviations(Canvas& canvas, const Tile& cell, const RecordingComparison& c) {
  std::vector<std::string> names;
  std::vector<double> values;
  double largest = 2 * ComparedStatistic::kClear;
  for (const ComparedStatistic& s : c.statistics) {
    if (std::isnan(s.deviations)) continue;
    names.push_back(s.name);
    values.push_back(s.deviations);
    if (std::isfinite(s.deviations)) largest = std::max(largest, s.deviations);
  }
  if (names.empty()) return;
  Axes axes(canvas, cell, linear_scale(0, 1.05 * largest, "standard deviations"), name_scale(names), {"Deviations"});
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double y = static_cast<double>(names.size() - 1 - i);
    axes.fill(0, std::min(values[i], 1.05 * largest), y + 0.2, y + 0.8,
              values[i] > ComparedStatistic::kClear ? kHighlightColour : kBarColour);
  }
  axes.vertical_line(ComparedStatistic::kClear, "clear", kLightTheme.ink);
  axes.finish();
}

void draw_surface(Canvas& canvas, int x, int y, int width, const std::string& title, EventSpan events,
                  const SensorSize& sensor, TimeNs t) {
  const ImageStack<float> surface = time_surface(events, sensor.width, sensor.height, t, kSurfaceTau_s);
  Image<Rgb> picture(sensor.width, sensor.height);
  const std::size_t plane = surface.values.size() / 2;
  for (std::size_t i = 0; i < plane; ++i) {
    const float on = surface.values[i], off = surface.values[plane + i];
    const auto faded = [](std::uint8_t colour, float part) {
      return static_cast<std::uint8_t>(255 + part * (static_cast<float>(colour) - 255));
    };
    const Rgb colour = on >= off ? preview::kOnColour : preview::kOffColour;
    const float part = std::max(on, off);
    picture.pixels()[i] = {faded(colour.r, part), faded(colour.g, part), faded(colour.b, part)};
  }
  canvas.text(x, y + kTitleHeight, title, kTitleHeight, kLightTheme.ink);
  const int height = width * sensor.height / sensor.width;
  const Tile area{x, y + 2 * kTitleHeight, width, height};
  canvas.draw(width >= sensor.width ? enlarge(picture, width, height) : picture, area.x, area.y);
  canvas.outline(area, kLightTheme.grid);
}

}  // namespace

Image<Rgb> draw_comparison(const RecordingComparison& c, EventSpan first, EventSpan second, TimeNs t) {
  constexpr int kSurfaceWidth = (kWidth - 3 * kMargin) / 2;
  const SensorSize& sensor = c.first.sensor;
  const int surface_row = c.scene ? kSurfaceWidth * sensor.height / std::max(1, sensor.width) + 4 * kTitleHeight : 0;
  Canvas canvas(kWidth, kHeader + kRow + surface_row + kMargin, kLightTheme.page);
  canvas.text(
      kMargin, 28, fmt::format("A: {}     B: {}", c.first_name, c.second_name),
      Canvas::fitting_height(c.first_name + c.second_name + "A:      B:  ", kHeadlineHeight, kWidth - 2 * kMargin),
      kLightTheme.ink);
  const auto cell = [](int column) { return Tile{kMargin + column * kCell, kHeader, kCell - kMargin, kRow}; };
  draw_intervals(canvas, cell(0), c);
  draw_counts(canvas, cell(1), c);
  draw_deviations(canvas, cell(2), c);
  if (c.scene) {
    const int y = kHeader + kRow + kMargin;
    const std::string at = fmt::format(": time surface at {:.3f} s", to_seconds(t));
    draw_surface(canvas, kMargin, y, kSurfaceWidth, "A" + at, first, sensor, t);
    draw_surface(canvas, 2 * kMargin + kSurfaceWidth, y, kSurfaceWidth, "B" + at, second, sensor, t);
  }
  return std::move(canvas).take();
}

}  // namespace esim::inline compare
