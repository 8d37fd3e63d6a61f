#include "esim/evaluate/report/figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "esim/plot/axes.h"

namespace esim::inline evaluate {
namespace {

constexpr Rgb kFamilyColours[] = {{222, 120, 24}, {52, 142, 84}, {38, 94, 188},  {190, 48, 110},
                                  {124, 82, 190}, {120, 94, 60}, {30, 150, 170}, {90, 90, 90}};
constexpr Rgb kSlowColour{212, 60, 60}, kFastColour{52, 142, 84}, kAllColour{96, 104, 120};

Rgb colour_of(const Window& window) {
  return window.name == "slow" ? kSlowColour : window.name == "fast" ? kFastColour : kAllColour;
}

/// The families in the order of their first scheme.
std::vector<std::string> families_of(const SamplingEvaluation& evaluation) {
  std::vector<std::string> families;
  for (const GoalCost& goal : evaluation.goals) families.push_back(goal.family);
  return families;
}

std::size_t family_index(const SamplingEvaluation& evaluation, const SchemeResult& scheme) {
  const std::vector<std::string> families = families_of(evaluation);
  return static_cast<std::size_t>(std::find(families.begin(), families.end(), scheme.family) - families.begin());
}

Rgb family_colour(std::size_t index) { return kFamilyColours[index % std::size(kFamilyColours)]; }

/// A scheme's colour: that of its family, paler for cheaper schemes.
Rgb scheme_colour(const SamplingEvaluation& evaluation, const SchemeResult& scheme) {
  const auto cost = [](const SchemeResult& s) { return s.windows.back().frame_equivalents_per_s; };
  int cheaper = 0, members = 0;
  for (const SchemeResult& other : evaluation.schemes) {
    if (other.family != scheme.family) continue;
    ++members;
    cheaper += cost(other) < cost(scheme) ? 1 : 0;
  }
  const float pale = members > 1 ? 0.7F * (1.0F - static_cast<float>(cheaper) / static_cast<float>(members - 1)) : 0.0F;
  return mix(family_colour(family_index(evaluation, scheme)), kLightTheme.page, pale);
}

/// The smallest and the largest of the values above 0.
struct Range {
  double low = std::numeric_limits<double>::infinity(), high = 0;
  void add(double value) {
    if (!(value > 0)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  Range with_room() const { return high > 0 ? Range{low / 1.4, high * 1.4} : Range{0.1, 1}; }
};

double quantile(std::vector<double> values, double rank) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const double position = rank * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const double fraction = position - static_cast<double>(below);
  return values[below] + fraction * (values[std::min(below + 1, values.size() - 1)] - values[below]);
}

/// Draws five quantiles and the mean at the height `y` of the diagram.
void draw_box(Axes& axes, const std::vector<double>& values, double y, double half_height, Rgb colour) {
  const double low = quantile(values, 0.05), lower = quantile(values, 0.25), middle = quantile(values, 0.5),
               upper = quantile(values, 0.75), high = quantile(values, 0.95);
  double mean = 0;
  for (const double value : values) mean += value / static_cast<double>(values.size());
  axes.line(std::vector<DataPoint>{{low, y}, {high, y}}, colour, 1);
  for (const double end : {low, high})
    axes.line(std::vector<DataPoint>{{end, y - 0.6 * half_height}, {end, y + 0.6 * half_height}}, colour, 1);
  axes.fill(lower, upper, y - half_height, y + half_height, mix(colour, kLightTheme.page, 0.45F));
  axes.line(std::vector<DataPoint>{{middle, y - half_height}, {middle, y + half_height}}, colour, 3);
  axes.dot({mean, y}, 3, kLightTheme.ink);
}

void draw_curve(Axes& axes, const SamplingEvaluation& evaluation, const std::string& family, std::size_t window,
                Rgb colour) {
  std::vector<DataPoint> curve;
  for (const SchemeResult& scheme : evaluation.schemes) {
    const WindowResult& result = scheme.windows[window];
    if (scheme.family == family && result.brightness.mean_rmse > 0)
      curve.push_back({result.frame_equivalents_per_s, result.brightness.mean_rmse});
  }
  std::sort(curve.begin(), curve.end(), [](const DataPoint& a, const DataPoint& b) { return a.x < b.x; });
  axes.line(curve, colour, 2);
  for (const DataPoint& point : curve) axes.dot(point, 4.5, colour);
}

}  // namespace

Image<Rgb> draw_motion(const SamplingEvaluation& evaluation) {
  constexpr int kWidth = 1000, kHeight = 360;
  const MotionCurve& motion = evaluation.motion;
  Canvas canvas(kWidth, kHeight, kLightTheme.page);
  double top = 1e-3;
  for (const double v : motion.mean_px_per_s) top = std::max(top, 1.1 * v);
  const double first = to_seconds(evaluation.span.start), last = to_seconds(evaluation.span.end);
  AxesOptions options{"Motion over time"};
  for (const Window& window : evaluation.windows) {
    options.legend.push_back({fmt::format("{}: {:.0f} px/s", window.name, window.mean_px_per_s),
                              mix(colour_of(window), kLightTheme.page, 0.5F)});
  }
  Axes axes(
      canvas, canvas.pixels().bounds(),
      linear_scale(first, last,
                   evaluation.event_spans.empty() ? "time (s)" : "time (s); events are compared where it is dark"),
      linear_scale(0, top, "mean motion field (px/s)"), std::move(options));
  for (const Window& window : evaluation.windows) {
    if (window.name == "all") continue;
    axes.fill(to_seconds(window.span.start), to_seconds(window.span.end), 0, top,
              mix(colour_of(window), kLightTheme.page, 0.8F));
  }
  for (std::size_t i = 0; i < evaluation.event_spans.size(); ++i) {
    const TimeSpan& span = evaluation.event_spans[i];
    axes.fill(to_seconds(span.start), to_seconds(span.end), 0, top,
              mix(colour_of(evaluation.windows[i]), kLightTheme.page, 0.4F));
  }
  std::vector<DataPoint> curve;
  for (std::size_t k = 0; k < motion.mean_px_per_s.size(); ++k)
    curve.push_back({to_seconds(motion.start) + static_cast<double>(k) / motion.rate_hz, motion.mean_px_per_s[k]});
  axes.line(curve, kLightTheme.ink, 2);
  axes.finish();
  return std::move(canvas).take();
}

Image<Rgb> draw_error_boxes(const SamplingEvaluation& evaluation) {
  constexpr int kWidth = 1000, kRow = 44, kAround = 84;
  const std::size_t schemes = evaluation.schemes.size(), windows = evaluation.windows.size();
  const int height = kAround + kRow * static_cast<int>(schemes);
  Range range;
  for (const SchemeResult& scheme : evaluation.schemes) {
    for (const WindowResult& window : scheme.windows) {
      range.add(quantile(window.brightness.rmse, 0.05));
      range.add(quantile(window.brightness.rmse, 0.95));
    }
  }
  range = range.with_room();
  std::vector<std::string> names;
  for (const SchemeResult& scheme : evaluation.schemes) names.push_back(scheme.text);
  AxesOptions options{"Error of the brightness L = ln(E + ε)"};
  for (const Window& window : evaluation.windows) options.legend.push_back({window.name, colour_of(window)});
  Canvas canvas(kWidth, height, kLightTheme.page);
  Axes axes(
      canvas, canvas.pixels().bounds(),
      logarithmic_scale(range.low, range.high, "RMSE of L of the pixels: percentiles 5, 25, 50, 75, 95; dot: mean"),
      name_scale(names), std::move(options));
  const double step = 0.84 / static_cast<double>(windows);
  for (std::size_t i = 0; i < schemes; ++i) {
    for (std::size_t w = 0; w < windows; ++w) {
      const double y = static_cast<double>(schemes - i) - 0.08 - step * (static_cast<double>(w) + 0.5);
      draw_box(axes, evaluation.schemes[i].windows[w].brightness.rmse, y, 0.36 * step,
               colour_of(evaluation.windows[w]));
    }
  }
  axes.finish();
  return std::move(canvas).take();
}

Image<Rgb> draw_error_over_cost(const SamplingEvaluation& evaluation) {
  constexpr int kPanel = 520, kHeight = 500, kLegend = 36;
  const std::size_t windows = evaluation.windows.size();
  Range cost, error;
  for (const SchemeResult& scheme : evaluation.schemes) {
    for (const WindowResult& window : scheme.windows) {
      cost.add(window.frame_equivalents_per_s);
      error.add(window.brightness.mean_rmse);
    }
  }
  error.add(evaluation.options.rmse_goal);
  cost = cost.with_room();
  error = error.with_room();
  Canvas canvas(kPanel * static_cast<int>(windows), kHeight, kLightTheme.page);
  const std::vector<std::string> families = families_of(evaluation);
  for (std::size_t w = 0; w < windows; ++w) {
    const Window& window = evaluation.windows[w];
    Axes axes(canvas, {kPanel * static_cast<int>(w), 0, kPanel, kHeight - kLegend},
              logarithmic_scale(cost.low, cost.high, "cost (frame-equivalents/s)"),
              logarithmic_scale(error.low, error.high, "mean RMSE of the brightness L"),
              {fmt::format("{}: {:.0f} px/s", window.name, window.mean_px_per_s)});
    axes.horizontal_line(evaluation.options.rmse_goal, kHighlightColour);
    for (std::size_t f = 0; f < families.size(); ++f) draw_curve(axes, evaluation, families[f], w, family_colour(f));
    axes.finish();
  }
  std::vector<LegendEntry> legend;
  for (std::size_t f = 0; f < families.size(); ++f)
    legend.push_back({families[f], family_colour(f), Mark::line_and_dots});
  legend.push_back({fmt::format("goal: RMSE {:g}", evaluation.options.rmse_goal), kHighlightColour, Mark::line});
  draw_legend_row(canvas, AxesOptions{}.min_left, kHeight - 14, legend, kLightTheme);
  return std::move(canvas).take();
}

Image<Rgb> draw_timing(const SamplingEvaluation& evaluation) {
  constexpr int kDiagram = 700, kTop = 34, kGap = 12;
  if (evaluation.event_spans.empty()) return {};
  const int height = std::max(480, kTop + 60 + kLegendLine * static_cast<int>(evaluation.schemes.size()));
  std::vector<LegendEntry> legend;
  for (const SchemeResult& scheme : evaluation.schemes)
    legend.push_back({scheme.text, scheme_colour(evaluation, scheme), Mark::line});
  Canvas canvas(kDiagram + legend_column_width(legend) + 2 * kGap, height, kLightTheme.page);
  Axes axes(canvas, {0, 0, kDiagram, height},
            logarithmic_scale(1e-7, 2e-2, "|t − t of the reference|", LabelStyle::seconds),
            linear_scale(0, 100, "matched events (%)"),
            {fmt::format("Timing of the matched events, window {}", evaluation.windows.back().name)});
  for (std::size_t i = 0; i < legend.size(); ++i) {
    const std::vector<double>& quantiles = evaluation.schemes[i].windows.back().events->quantiles_s;
    std::vector<DataPoint> curve;
    for (std::size_t percent = 0; percent < quantiles.size(); ++percent)
      curve.push_back({std::max(quantiles[percent], 1e-9), static_cast<double>(percent)});
    axes.line(curve, legend[i].colour, 2);
  }
  draw_legend_column(canvas, kDiagram + kGap, kTop + kTextHeight, legend, kLightTheme);
  axes.finish();
  return std::move(canvas).take();
}

}  // namespace esim::inline evaluate
