#include <algorithm>
#include <cmath>
#include <cstddef>

#include "esim/fit/sensor_fit.h"
#include "esim/plot/axes.h"

namespace esim::inline fit {
namespace {

constexpr int kWidth = 1600, kMargin = 16, kRow = 460, kColumns = 2, kCell = (kWidth - 2 * kMargin) / kColumns;
constexpr std::size_t kBars = 50;
constexpr double kOutliers = 0.002;  // fraction of the values beyond each side of the figure
constexpr Rgb kFitColour{214, 96, 30};

void draw(Canvas& canvas, const Tile& cell, const FittedDistribution& d) {
  std::vector<double> sorted = d.values;
  std::sort(sorted.begin(), sorted.end());
  const auto quantile = [&](double part) {
    return sorted[static_cast<std::size_t>(part * static_cast<double>(sorted.size() - 1))];
  };
  double low = quantile(kOutliers), high = quantile(1 - kOutliers);
  const double beyond = std::max(0.05 * (high - low), 1e-6 * std::max(1e-3, std::abs(high)));
  low -= beyond, high += beyond;
  const double width = (high - low) / kBars;
  std::vector<double> bars(kBars);
  for (const double value : sorted) {
    const double place = (value - low) / width;
    if (place >= 0 && place < kBars)
      bars[static_cast<std::size_t>(place)] += 1 / (width * static_cast<double>(sorted.size()));
  }
  std::vector<DataPoint> line;
  constexpr int kPoints = 400;
  double top = *std::max_element(bars.begin(), bars.end());
  for (int i = 0; i <= kPoints; ++i) {
    const double x = low + (high - low) * i / kPoints;
    line.push_back({x, d.density(x)});
    top = std::max(top, line.back().y);
  }
  Axes axes(canvas, cell, linear_scale(low, high, d.axis), linear_scale(0, 1.1 * top, "density"),
            {d.title, {{"measured", kBarColour}, {"fitted", kFitColour}}});
  for (std::size_t i = 0; i < kBars; ++i)
    axes.fill(low + width * static_cast<double>(i), low + width * static_cast<double>(i + 1), 0, bars[i], kBarColour);
  axes.line(line, kFitColour);
  axes.finish();
}

}  // namespace

Image<Rgb> draw_fit(const SensorFit& fit) {
  const int rows = (static_cast<int>(fit.distributions.size()) + kColumns - 1) / kColumns;
  Canvas canvas(kWidth, std::max(1, rows) * kRow + 2 * kMargin, kLightTheme.page);
  for (std::size_t i = 0; i < fit.distributions.size(); ++i) {
    const int column = static_cast<int>(i) % kColumns, row = static_cast<int>(i) / kColumns;
    draw(canvas, {kMargin + column * kCell, kMargin + row * kRow, kCell - kMargin, kRow - kMargin},
         fit.distributions[i]);
  }
  return std::move(canvas).take();
}

}  // namespace esim::inline fit
