#include "esim/stats/figure.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "esim/stats/axes.h"

namespace esim::inline stats {
namespace {

constexpr int kWidth = 1920, kHeight = 1104;
constexpr int kHeader = 62, kMargin = 18;
constexpr int kCellWidth = (kWidth - 2 * kMargin) / 3, kCellHeight = (kHeight - kHeader) / 2;
constexpr int kLeft = 66, kTop = 62, kRight = 24, kBottom = 62;  // around the diagram of a cell
constexpr std::size_t kMarkedHotPixels = 50;

struct Cell {
  int column = 0, row = 0;
  int x() const { return kMargin + column * kCellWidth; }
  int y() const { return kHeader + row * kCellHeight; }
  Tile diagram() const { return {x() + kLeft, y() + kTop, kCellWidth - kLeft - kRight, kCellHeight - kTop - kBottom}; }
};

// A unit and its factor.
struct Unit {
  double factor;
  const char* name;
};
Unit rate_unit(double largest) {
  if (largest >= 1e6) return {1e-6, "Mev/s"};
  return largest >= 1e3 ? Unit{1e-3, "kev/s"} : Unit{1, "ev/s"};
}

Rgb viridis(double position) {
  static const cv::Mat kColours = [] {
    cv::Mat ramp(1, 256, CV_8UC1), coloured;
    for (int i = 0; i < 256; ++i) ramp.at<std::uint8_t>(0, i) = static_cast<std::uint8_t>(i);
    cv::applyColorMap(ramp, coloured, cv::COLORMAP_VIRIDIS);
    return coloured;
  }();
  const auto bgr = kColours.at<cv::Vec3b>(0, static_cast<int>(std::lround(255 * std::clamp(position, 0.0, 1.0))));
  return {bgr[2], bgr[1], bgr[0]};
}

void draw_swatch(Canvas& canvas, int x, int baseline, Rgb colour, const std::string& label) {
  canvas.fill({x, baseline - 11, 12, 12}, colour);
  canvas.text(x + 18, baseline, label, 10, kInk);
}

// ON upwards, OFF downwards, in at most 260 bars.
void draw_rate(Canvas& canvas, const Cell& cell, const Statistics& s) {
  const double bin_s = to_seconds(s.rate.bin_width());
  const std::size_t group = (s.rate.bins().size() + 259) / 260;
  struct Bar {
    double start_s, end_s, on_hz, off_hz;
  };
  std::vector<Bar> bars;
  double largest = 0;
  for (std::size_t first = 0; first < s.rate.bins().size(); first += group) {
    RateCurve::Bin sum;
    const std::size_t end = std::min(first + group, s.rate.bins().size());
    for (std::size_t i = first; i < end; ++i) {
      sum.on += s.rate.bins()[i].on;
      sum.off += s.rate.bins()[i].off;
    }
    // The end of the recording may cut the last bar; a bar that is too short is omitted.
    const double start_s = static_cast<double>(first) * bin_s, full_s = static_cast<double>(group) * bin_s;
    const double covered_s = std::min(full_s, s.duration_s() - start_s);
    if (covered_s < 0.5 * full_s && first > 0) break;
    const double width_s = std::max(covered_s, 1e-9);
    bars.push_back(
        {start_s, start_s + width_s, static_cast<double>(sum.on) / width_s, static_cast<double>(sum.off) / width_s});
    largest = std::max({largest, bars.back().on_hz, bars.back().off_hz});
  }
  const Unit unit = rate_unit(largest);
  const double top = largest > 0 ? 1.08 * largest * unit.factor : 1.0;
  const double first_s = to_seconds(s.first), last_s = first_s + std::max(s.duration_s(), 1e-6);
  Axes axes(canvas, cell.diagram(), "Event rate over time", linear_scale(first_s, last_s, "time, s"),
            linear_scale(-top, top, unit.name, true));
  for (const Bar& bar : bars) {
    axes.fill(first_s + bar.start_s, first_s + bar.end_s, 0, bar.on_hz * unit.factor, kOnColour);
    axes.fill(first_s + bar.start_s, first_s + bar.end_s, -bar.off_hz * unit.factor, 0, kOffColour);
  }
  axes.horizontal_line(0, kInk);
  axes.finish();
  const int right = cell.diagram().x + cell.diagram().width;
  draw_swatch(canvas, right - 130, cell.diagram().y - 10, kOnColour, "ON");
  draw_swatch(canvas, right - 62, cell.diagram().y - 10, kOffColour, "OFF");
}

void draw_intervals(Canvas& canvas, const Cell& cell, const Statistics& s) {
  constexpr int kBinsPerBar = 2;
  const IntervalHistogram& intervals = s.intervals;
  const auto decade = [](double value, auto round) { return std::pow(10.0, round(std::log10(value))); };
  double low = 1e-6, high = 1e2;
  if (intervals.total() > 0) {
    low =
        std::clamp(decade(to_seconds(intervals.shortest()) + 1e-9, [](double x) { return std::floor(x); }), 1e-6, 10.0);
    high = std::clamp(decade(to_seconds(intervals.longest()), [](double x) { return std::ceil(x); }), 10 * low, 1e2);
  }
  std::vector<double> bars = intervals.bars(kBinsPerBar);
  for (double& bar : bars) bar *= 100;
  const double largest = *std::max_element(bars.begin(), bars.end());
  Axes axes(canvas, cell.diagram(), "Time between events of a pixel",
            decade_scale(low, high, "interval (20 bins per decade)", true),
            linear_scale(0, largest > 0 ? 1.15 * largest : 1.0, "% of the intervals"));
  for (std::size_t i = 0; i < bars.size(); ++i) {
    const int bin = static_cast<int>(i) * kBinsPerBar;
    if (IntervalHistogram::edge_s(bin + kBinsPerBar) <= low || IntervalHistogram::edge_s(bin) >= high) continue;
    axes.fill(IntervalHistogram::edge_s(bin), IntervalHistogram::edge_s(bin + kBinsPerBar), 0, bars[i], kBarColour);
  }
  if (intervals.total() > 0) {
    axes.vertical_line(intervals.quantile_s(0.01), "1 %", kFaintInk);
    axes.vertical_line(intervals.quantile_s(0.5), "median", kAlarmColour);
    axes.vertical_line(intervals.quantile_s(0.99), "99 %", kFaintInk);
  }
  axes.finish();
}

// The 99.5th percentile of the counts of active pixels.
std::uint32_t bright_count(const Statistics& s) {
  std::vector<std::uint32_t> counts;
  std::copy_if(s.counts.pixels().begin(), s.counts.pixels().end(), std::back_inserter(counts),
               [](std::uint32_t count) { return count > 0; });
  if (counts.empty()) return 1;
  const auto at = counts.begin() + static_cast<std::ptrdiff_t>(0.995 * static_cast<double>(counts.size() - 1));
  std::nth_element(counts.begin(), at, counts.end());
  return *at;
}

void draw_colour_bar(Canvas& canvas, const Tile& bar, double full_hz) {
  for (int i = 0; i < bar.height; ++i) {
    canvas.fill({bar.x, bar.y + i, bar.width, 1}, viridis(1 - (i + 0.5) / bar.height));
  }
  canvas.outline({bar.x - 1, bar.y - 1, bar.width + 2, bar.height + 2}, kFaintInk);
  for (const Tick& tick : linear_scale(0, full_hz, "").ticks) {
    const int y = bar.y + static_cast<int>(std::lround((1 - tick.value / full_hz) * (bar.height - 1)));
    canvas.fill({bar.x + bar.width, y, 5, 1}, kFaintInk);
    canvas.text(bar.x + bar.width + 9, y + 5, tick.label, 10, kInk);
  }
}

void draw_map(Canvas& canvas, const Cell& cell, const Statistics& s) {
  constexpr int kBarSpace = 84;
  const Tile diagram = cell.diagram();
  const int left = cell.x() + kLeft - 56, max_width = diagram.x + diagram.width - left - kBarSpace;
  canvas.text(left, diagram.y - 32, "Rate of each pixel", 13, kInk);
  if (s.counts.empty()) return;
  const int width = s.counts.width(), height = s.counts.height();
  const double scale =
      std::min(static_cast<double>(max_width) / width, static_cast<double>(diagram.height + 30) / height);
  const int shown_width = std::max(1, static_cast<int>(scale * width)),
            shown_height = std::max(1, static_cast<int>(scale * height));

  const double full = bright_count(s);
  Image<float> counts(width, height);
  std::copy(s.counts.pixels().begin(), s.counts.pixels().end(), counts.pixels().begin());
  const bool reduced = shown_width < width;
  if (reduced) counts = reduce_mean(counts, shown_width, shown_height);
  Image<Rgb> colours(counts.width(), counts.height());
  std::transform(counts.pixels().begin(), counts.pixels().end(), colours.pixels().begin(),
                 [&](float count) { return viridis(count / full); });
  canvas.draw(reduced ? colours : enlarge(colours, shown_width, shown_height), left, diagram.y);
  canvas.outline({left - 1, diagram.y - 1, shown_width + 2, shown_height + 2}, kFaintInk);
  for (std::size_t i = 0; i < std::min(s.hot_pixels.size(), kMarkedHotPixels); ++i) {
    const int x = left + static_cast<int>(scale * (s.hot_pixels[i].x + 0.5));
    const int y = diagram.y + static_cast<int>(scale * (s.hot_pixels[i].y + 0.5));
    for (const int side : {13, 15}) canvas.outline({x - side / 2, y - side / 2, side, side}, kAlarmColour);
  }
  draw_colour_bar(canvas, {left + shown_width + 16, diagram.y, 16, shown_height}, full * s.per_second(1));
  canvas.text(left, diagram.y - 11, "ev/s, ON and OFF; full scale: 99.5 % of the active pixels are below", 10,
              kFaintInk);
  if (!s.hot_pixels.empty()) {
    canvas.text(left, diagram.y + shown_height + 19, "red squares: hot pixels", 10, kAlarmColour);
  }
}

// Bins of whole counts, up to 20 per decade.
void draw_pixel_rates(Canvas& canvas, const Cell& cell, const Statistics& s) {
  std::vector<std::uint64_t> edges = {1};
  while (edges.back() <= s.largest_count) {
    edges.push_back(std::max(edges.back() + 1, static_cast<std::uint64_t>(static_cast<double>(edges.back()) * 1.122)));
  }
  const auto bin_of = [&](std::uint64_t count) {
    return static_cast<std::size_t>(std::upper_bound(edges.begin(), edges.end(), count) - edges.begin()) - 1;
  };
  std::vector<double> pixels(edges.size()), hot(edges.size());
  for (const std::uint32_t count : s.counts.pixels()) {
    if (count > 0) ++pixels[bin_of(count)];
  }
  for (const HotPixel& pixel : s.hot_pixels) ++hot[bin_of(pixel.events)];
  const double max = std::max(10.0, *std::max_element(pixels.begin(), pixels.end()));
  const double rate_of_one = s.per_second(1) > 0 ? s.per_second(1) : 1.0;
  const auto edge_hz = [&](std::size_t i) { return (static_cast<double>(edges[i]) - 0.5) * rate_of_one; };
  const auto lowest = std::find_if(pixels.begin(), pixels.end(), [](double number) { return number > 0; });
  const double low_hz = edge_hz(lowest == pixels.end() ? 0 : static_cast<std::size_t>(lowest - pixels.begin()));
  Axes axes(canvas, cell.diagram(), "Histogram of the pixels' rates",
            decade_scale(0.8 * low_hz, std::max(8 * low_hz, 1.25 * edge_hz(edges.size() - 1)), "ev/s of a pixel"),
            decade_scale(0.7, 1.6 * max, "pixels"));
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
    axes.fill(edge_hz(i), edge_hz(i + 1), 0.7, pixels[i], kBarColour);
    axes.fill(edge_hz(i), edge_hz(i + 1), 0.7, hot[i], kAlarmColour);
  }
  axes.finish();
  const int right = cell.diagram().x + cell.diagram().width;
  draw_swatch(canvas, right - 110, cell.diagram().y - 10, kAlarmColour, fmt::format("hot: {}", s.hot_pixels.size()));
}

void draw_phases(Canvas& canvas, const Cell& cell, const Statistics& s) {
  const PhaseTest phase = s.phase.value_or(PhaseTest{});
  const bool given = !s.periodicity;
  std::string title = "Time stamps modulo a period";
  if (s.phase) {
    title = fmt::format("Time stamps modulo {} ({:.6g} Hz{})", format_duration(1 / phase.frequency_hz),
                        phase.frequency_hz, given ? "" : ", strongest found");
  }
  const double even = std::max(1.0, static_cast<double>(phase.events)) / PhaseTest::kBins;
  const double largest = static_cast<double>(*std::max_element(phase.histogram.begin(), phase.histogram.end())) / even;
  Axes axes(canvas, cell.diagram(), title, linear_scale(0, 1, "phase in the period"),
            linear_scale(0, std::max(1.5, 1.2 * largest), "events, relative to an even spread"));
  const bool bands = s.banding() == Banding::strong || s.banding() == Banding::weak;
  for (std::size_t i = 0; i < phase.histogram.size(); ++i) {
    const double left = static_cast<double>(i) / PhaseTest::kBins;
    axes.fill(left, left + 1.0 / PhaseTest::kBins, 0, static_cast<double>(phase.histogram[i]) / even,
              bands ? kAlarmColour : kBarColour);
  }
  axes.horizontal_line(1, kInk);
  axes.finish();
  const Tile diagram = cell.diagram();
  canvas.text(diagram.x + 10, diagram.y + 20, verdict(s), 11, bands ? kAlarmColour : kInk);
}

void draw_report(Canvas& canvas, const Cell& cell, const Statistics& s) {
  constexpr int kLine = 15, kValueColumn = 168;
  int y = cell.y() + kTop - 32;
  for (const StatisticsSection& section : statistics_sections(s)) {
    canvas.text(cell.x() + 10, y, section.title, 11, kInk);
    y += kLine + 2;
    for (const StatisticsLine& line : section.lines) {
      if (line.label.empty()) continue;  // hot pixels, which the map shows
      canvas.text(cell.x() + 10, y, line.label, 10, kFaintInk);
      canvas.text(cell.x() + kValueColumn, y, line.value, 10, kInk);
      y += kLine;
    }
    y += 8;
  }
}

}  // namespace

Image<Rgb> draw_figure(const NamedStatistics& file) {
  const Statistics& s = file.statistics;
  Canvas canvas(kWidth, kHeight, kPaper);
  canvas.text(kMargin + 10, 36, file.name, 15, kInk);
  canvas.fill({kMargin, kHeader - 8, kWidth - 2 * kMargin, 1}, kGrid);
  draw_rate(canvas, {0, 0}, s);
  draw_intervals(canvas, {1, 0}, s);
  draw_map(canvas, {2, 0}, s);
  draw_pixel_rates(canvas, {0, 1}, s);
  draw_phases(canvas, {1, 1}, s);
  draw_report(canvas, {2, 1}, s);
  return std::move(canvas).take();
}

}  // namespace esim::inline stats
