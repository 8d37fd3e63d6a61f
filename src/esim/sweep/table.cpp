#include "esim/sweep/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "esim/files/number_text.h"
#include "esim/plot/axes.h"
#include "esim/stats/statistics_text.h"

namespace esim::inline sweep {
namespace {

std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

std::string csv_cell(double value) { return std::isfinite(value) ? fmt::format("{}", value) : ""; }

/// The text of a value, or "-" if it is undefined.
std::string or_dash(double value, const std::string& text) { return std::isfinite(value) ? text : "-"; }

/// The last part of a dotted key, or the key if two options end alike.
std::string short_key(const SweepPlan& plan, std::size_t option) {
  const auto last_part = [](const std::string& key) { return key.substr(key.rfind('.') + 1); };
  const std::string own = last_part(plan.over[option].key);
  const auto alike =
      std::ranges::count_if(plan.over, [&](const SweptOption& each) { return last_part(each.key) == own; });
  return alike == 1 ? own : plan.over[option].key;
}

/// The values of an option as numbers; empty if one is not a number, if there are fewer than two, or for seeds.
std::vector<double> numbers_of(const SweptOption& option) {
  std::vector<double> numbers;
  if (option.key == "seed" || option.key.ends_with(".seed")) return {};
  for (const std::string& value : option.values) {
    if (!parse_number(value, numbers.emplace_back())) return {};
  }
  return numbers.size() < 2 ? std::vector<double>{} : numbers;
}

constexpr std::array<Rgb, 8> kCurveColours{Rgb{38, 94, 188}, {222, 120, 24}, {52, 142, 84},  {190, 48, 110},
                                           {124, 82, 190},   {120, 94, 60},  {30, 150, 170}, {90, 90, 90}};

/// The curves of a diagram, by their names.
struct Curve {
  std::string name;
  std::vector<DataPoint> points;
};

/// The curves over an option: one for each combination of the values of the others and of the sensor.
std::vector<Curve> curves_over(std::size_t option, const std::vector<double>& numbers, const SweepPlan& plan,
                               const std::vector<SweepRow>& rows) {
  std::vector<Curve> curves;
  std::map<std::size_t, std::size_t> sensors;  // rows so far of each run
  for (const SweepRow& row : rows) {
    const std::size_t sensor = sensors[row.run]++;
    std::string name;
    for (std::size_t k = 0; k < plan.over.size(); ++k) {
      if (k != option)
        name += fmt::format("{}{} = {}", name.empty() ? "" : ", ", short_key(plan, k), plan.runs[row.run][k]);
    }
    if (rows.size() > plan.runs.size()) name += fmt::format("{}sensor {}", name.empty() ? "" : ", ", sensor);
    auto curve = std::ranges::find(curves, name, &Curve::name);
    if (curve == curves.end()) curve = curves.insert(curves.end(), {name, {}});
    const auto& values = plan.over[option].values;
    const auto place = std::ranges::find(values, plan.runs[row.run][option]) - values.begin();
    curve->points.push_back({numbers[static_cast<std::size_t>(place)], row.mean_rate_hz});
  }
  for (Curve& curve : curves) std::ranges::sort(curve.points, {}, &DataPoint::x);
  return curves;
}

/// Logarithmic if all values are above 0 and cover a wide range. Linear scales of `from_zero` begin at 0.
Scale scale_of(double low, double high, const std::string& title, bool from_zero) {
  constexpr double kWide = 8, kRoom = 0.05;
  if (low > 0 && high / low >= kWide) {
    const double room = std::pow(high / low, kRoom);
    return logarithmic_scale(low / room, high * room, title);
  }
  const double room = kRoom * (from_zero ? high : high - low);
  return linear_scale(from_zero ? 0 : low - room, high + room, title);
}

}  // namespace

std::string to_csv(const SweepPlan& plan, const std::vector<SweepRow>& rows) {
  std::string csv = "run";
  for (const SweptOption& option : plan.over) csv += "," + csv_cell(option.key);
  csv +=
      ",folder,events,on_fraction,mean_rate_hz,rate_per_pixel_hz,interval_min_s,interval_1_percent_s,"
      "interval_median_s,interval_99_percent_s,real_time_factor\n";
  for (const SweepRow& row : rows) {
    csv += std::to_string(row.run);
    for (const std::string& value : plan.runs[row.run]) csv += "," + csv_cell(value);
    csv += fmt::format(",{},{}", csv_cell(row.folder.string()), row.events);
    for (const double value :
         {row.on_fraction, row.mean_rate_hz, row.rate_per_pixel_hz, row.interval_min_s, row.interval_1_percent_s,
          row.interval_median_s, row.interval_99_percent_s, row.real_time_factor})
      csv += "," + csv_cell(value);
    csv += "\n";
  }
  return csv;
}

std::string describe(const SweepPlan& plan, const std::vector<SweepRow>& rows) {
  std::vector<std::vector<std::string>> lines(1);
  for (std::size_t k = 0; k < plan.over.size(); ++k) lines[0].push_back(short_key(plan, k));
  lines[0].insert(lines[0].end(), {"events", "ON", "rate", "per pixel", "median interval", "real time", "folder"});
  for (const SweepRow& row : rows) {
    std::vector<std::string> line = plan.runs[row.run];
    line.insert(line.end(),
                {grouped(row.events), or_dash(row.on_fraction, fmt::format("{:.1f} %", 100 * row.on_fraction)),
                 format_rate(row.mean_rate_hz), format_rate(row.rate_per_pixel_hz),
                 or_dash(row.interval_median_s, format_duration(row.interval_median_s)),
                 fmt::format("{:.2f}x", row.real_time_factor), row.folder.string()});
    lines.push_back(std::move(line));
  }
  std::vector<std::size_t> widths(lines[0].size());
  for (const std::vector<std::string>& line : lines) {
    for (std::size_t column = 0; column < line.size(); ++column)
      widths[column] = std::max(widths[column], line[column].size());
  }
  std::string text;
  for (const std::vector<std::string>& line : lines) {
    for (std::size_t column = 0; column + 1 < line.size(); ++column)
      text += fmt::format("{:>{}}  ", line[column], widths[column]);
    text += line.back() + "\n";
  }
  return text;
}

std::optional<Image<Rgb>> draw_rates(const SweepPlan& plan, const std::vector<SweepRow>& rows) {
  constexpr int kWidth = 720, kHeight = 420, kGap = 16;
  struct Diagram {
    std::size_t option;
    std::vector<Curve> curves;
    std::vector<LegendEntry> legend;
    std::vector<Rgb> colours;
  };
  std::vector<Diagram> diagrams;
  int legend_width = 0;
  for (std::size_t k = 0; k < plan.over.size(); ++k) {
    const std::vector<double> numbers = numbers_of(plan.over[k]);
    if (numbers.empty()) continue;
    Diagram& diagram = diagrams.emplace_back(Diagram{k, curves_over(k, numbers, plan, rows), {}, {}});
    const bool few = diagram.curves.size() <= kCurveColours.size();
    for (std::size_t i = 0; i < diagram.curves.size(); ++i) {
      diagram.colours.push_back(few ? kCurveColours[i] : kBarColour);
      if (few && !diagram.curves[i].name.empty())
        diagram.legend.push_back({diagram.curves[i].name, diagram.colours[i], Mark::line_and_dots});
    }
    if (!few)
      diagram.legend = {{fmt::format("{} combinations of the other options", diagram.curves.size()), kBarColour,
                         Mark::line_and_dots}};
    if (!diagram.legend.empty()) legend_width = std::max(legend_width, legend_column_width(diagram.legend) + 2 * kGap);
  }
  if (diagrams.empty()) return std::nullopt;
  Canvas canvas(kWidth + legend_width, kHeight * static_cast<int>(diagrams.size()), kLightTheme.page);
  double low_rate = rows.front().mean_rate_hz, high_rate = low_rate;
  for (const SweepRow& row : rows)
    low_rate = std::min(low_rate, row.mean_rate_hz), high_rate = std::max(high_rate, row.mean_rate_hz);
  for (std::size_t d = 0; d < diagrams.size(); ++d) {
    const Diagram& diagram = diagrams[d];
    const std::string& key = plan.over[diagram.option].key;
    const std::vector<double> numbers = numbers_of(plan.over[diagram.option]);
    const auto [low, high] = std::ranges::minmax(numbers);
    const int top = kHeight * static_cast<int>(d);
    Axes axes(canvas, {0, top, kWidth, kHeight - kGap}, scale_of(low, high, key, false),
              scale_of(low_rate, high_rate, "mean rate (ev/s)", true), {"Events over " + key});
    for (std::size_t i = 0; i < diagram.curves.size(); ++i) {
      axes.line(diagram.curves[i].points, diagram.colours[i], 2);
      for (const DataPoint& point : diagram.curves[i].points) axes.dot(point, 4, diagram.colours[i]);
    }
    axes.finish();
    draw_legend_column(canvas, kWidth + kGap, top + 34 + kTextHeight, diagram.legend, kLightTheme);
  }
  return std::move(canvas).take();
}

}  // namespace esim::inline sweep
