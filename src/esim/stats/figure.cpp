#include "esim/stats/figure.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "esim/plot/axes.h"
#include "esim/plot/colour_bar.h"
#include "esim/preview/pictures.h"

namespace esim::inline stats {
namespace {

constexpr int kWidth = 1920, kHeight = 1104;
constexpr int kHeader = 56, kMargin = 16, kGap = 14;
constexpr int kCellWidth = (kWidth - 2 * kMargin + kGap) / 3, kCellHeight = (kHeight - kHeader) / 2;
constexpr std::size_t kMarkedHotPixels = 50;

struct Cell {
  int column = 0, row = 0;
  Tile area() const {
    return {kMargin + column * kCellWidth, kHeader + row * kCellHeight, kCellWidth - kGap, kCellHeight - kGap};
  }
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
  Axes axes(canvas, cell.area(), linear_scale(first_s, last_s, "time (s)"),
            linear_scale(-top, top, fmt::format("event rate ({})", unit.name), LabelStyle::magnitudes),
            {"Event rate over time", {{"ON", kOnColour}, {"OFF", kOffColour}}});
  for (const Bar& bar : bars) {
    axes.fill(first_s + bar.start_s, first_s + bar.end_s, 0, bar.on_hz * unit.factor, kOnColour);
    axes.fill(first_s + bar.start_s, first_s + bar.end_s, -bar.off_hz * unit.factor, 0, kOffColour);
  }
  axes.horizontal_line(0, kLightTheme.ink);
  axes.finish();
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
  Axes axes(canvas, cell.area(), logarithmic_scale(low, high, "interval (20 bins per decade)", LabelStyle::seconds),
            linear_scale(0, largest > 0 ? 1.15 * largest : 1.0, "intervals (%)"), {"Time between events of a pixel"});
  for (std::size_t i = 0; i < bars.size(); ++i) {
    const int bin = static_cast<int>(i) * kBinsPerBar;
    if (IntervalHistogram::edge_s(bin + kBinsPerBar) <= low || IntervalHistogram::edge_s(bin) >= high) continue;
    axes.fill(IntervalHistogram::edge_s(bin), IntervalHistogram::edge_s(bin + kBinsPerBar), 0, bars[i], kBarColour);
  }
  if (intervals.total() > 0) {
    axes.vertical_line(intervals.quantile_s(0.01), "1 %", kLightTheme.faint_ink);
    axes.vertical_line(intervals.quantile_s(0.5), "median", kHighlightColour);
    axes.vertical_line(intervals.quantile_s(0.99), "99 %", kLightTheme.faint_ink);
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

void draw_map(Canvas& canvas, const Cell& cell, const Statistics& s) {
  constexpr int kTop = 34, kBelow = 46, kBarSpace = 100;
  const Tile area = cell.area();
  canvas.text(area.x, area.y + 6 + kTitleHeight, "Rate of each pixel", kTitleHeight, kLightTheme.ink);
  if (s.counts.empty()) return;
  const int width = s.counts.width(), height = s.counts.height(), y0 = area.y + kTop;
  const double scale = std::min(static_cast<double>(area.width - kBarSpace) / width,
                                static_cast<double>(area.height - kTop - kBelow) / height);
  const int shown_width = std::max(1, static_cast<int>(scale * width)),
            shown_height = std::max(1, static_cast<int>(scale * height));

  const float full = static_cast<float>(bright_count(s));
  Image<float> counts(width, height);
  std::copy(s.counts.pixels().begin(), s.counts.pixels().end(), counts.pixels().begin());
  const bool reduced = shown_width < width;
  if (reduced) counts = reduce_mean(counts, shown_width, shown_height);
  Image<Rgb> colours(counts.width(), counts.height());
  std::transform(counts.pixels().begin(), counts.pixels().end(), colours.pixels().begin(),
                 [&](float count) { return viridis(count / full); });
  canvas.draw(reduced ? colours : enlarge(colours, shown_width, shown_height), area.x, y0);
  canvas.outline({area.x - 1, y0 - 1, shown_width + 2, shown_height + 2}, kLightTheme.faint_ink);
  for (std::size_t i = 0; i < std::min(s.hot_pixels.size(), kMarkedHotPixels); ++i) {
    const int x = area.x + static_cast<int>(scale * (s.hot_pixels[i].x + 0.5));
    const int y = y0 + static_cast<int>(scale * (s.hot_pixels[i].y + 0.5));
    for (const int side : {13, 15}) canvas.outline({x - side / 2, y - side / 2, side, side}, kHighlightColour);
  }
  const double full_hz = full * s.per_second(1);
  draw_colour_bar(
      canvas, {area.x + shown_width + 16, y0, 16, shown_height}, linear_scale(0, full_hz, "ev/s"), Direction::vertical,
      [&](double rate_hz) { return viridis(static_cast<float>(rate_hz / full_hz)); }, kLightTheme);
  const int baseline = y0 + shown_height + 2 * kTextHeight;
  canvas.text(area.x, baseline, "ON and OFF; 99.5 % of the active pixels are within the scale", kTextHeight,
              kLightTheme.faint_ink);
  if (!s.hot_pixels.empty())
    canvas.text(area.x, baseline + 2 * kTextHeight, "red squares: hot pixels", kTextHeight, kHighlightColour);
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
  AxesOptions options{"Histogram of the pixels' rates"};
  if (!s.hot_pixels.empty()) options.legend = {{fmt::format("hot: {}", s.hot_pixels.size()), kHighlightColour}};
  Axes axes(
      canvas, cell.area(),
      logarithmic_scale(0.8 * low_hz, std::max(8 * low_hz, 1.25 * edge_hz(edges.size() - 1)), "rate of a pixel (ev/s)"),
      logarithmic_scale(0.7, 1.6 * max, "pixels"), std::move(options));
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
    axes.fill(edge_hz(i), edge_hz(i + 1), 0.7, pixels[i], kBarColour);
    axes.fill(edge_hz(i), edge_hz(i + 1), 0.7, hot[i], kHighlightColour);
  }
  axes.finish();
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
  Axes axes(canvas, cell.area(), linear_scale(0, 1, "phase in the period"),
            linear_scale(0, std::max(1.5, 1.2 * largest), "events / events if spread evenly"), {title});
  const bool bands = s.banding() == Banding::strong || s.banding() == Banding::weak;
  for (std::size_t i = 0; i < phase.histogram.size(); ++i) {
    const double left = static_cast<double>(i) / PhaseTest::kBins;
    axes.fill(left, left + 1.0 / PhaseTest::kBins, 0, static_cast<double>(phase.histogram[i]) / even,
              bands ? kHighlightColour : kBarColour);
  }
  axes.horizontal_line(1, kLightTheme.ink);
  axes.note(verdict(s), bands ? kHighlightColour : kLightTheme.ink);
  axes.finish();
}

void draw_report(Canvas& canvas, const Cell& cell, const Statistics& s) {
  constexpr int kMaxLine = 17, kValueColumn = 176;
  const Tile area = cell.area();
  const std::vector<StatisticsSection> sections = statistics_sections(s);
  const auto is_shown = [](const StatisticsLine& line) { return !line.label.empty(); };  // not hot pixels: see the map
  double lines = 0;
  for (const StatisticsSection& section : sections)
    lines += 1.7 + static_cast<double>(std::ranges::count_if(section.lines, is_shown));
  const double line = std::min<double>(kMaxLine, (area.height - kTitleHeight) / lines);
  double y = area.y + 6 + kTitleHeight;
  const auto write = [&](int x, const std::string& text, int height, Rgb colour) {
    height = Canvas::fitting_height(text, height, area.x + area.width - x);
    canvas.text(x, static_cast<int>(std::lround(y)), text, height, colour);
  };
  for (const StatisticsSection& section : sections) {
    write(area.x, section.title, kTitleHeight - 1, kLightTheme.ink);
    y += 1.15 * line;
    for (const auto& [label, value] : section.lines) {
      if (label.empty()) continue;
      write(area.x, label, kTextHeight, kLightTheme.faint_ink);
      write(area.x + kValueColumn, value, kTextHeight, kLightTheme.ink);
      y += line;
    }
    y += 0.55 * line;
  }
}

}  // namespace

Image<Rgb> draw_figure(const NamedStatistics& file) {
  const Statistics& s = file.statistics;
  Canvas canvas(kWidth, kHeight, kLightTheme.page);
  const int headline = Canvas::fitting_height(file.name, kHeadlineHeight, kWidth - 2 * kMargin);
  canvas.text(kMargin, 32, file.name, headline, kLightTheme.ink);
  canvas.fill({kMargin, kHeader - 10, kWidth - 2 * kMargin, 1}, kLightTheme.grid);
  draw_rate(canvas, {0, 0}, s);
  draw_intervals(canvas, {1, 0}, s);
  draw_map(canvas, {2, 0}, s);
  draw_pixel_rates(canvas, {0, 1}, s);
  draw_phases(canvas, {1, 1}, s);
  draw_report(canvas, {2, 1}, s);
  return std::move(canvas).take();
}

}  // namespace esim::inline stats
