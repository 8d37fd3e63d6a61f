#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "esim/characterise/characterisation.h"
#include "esim/stats/statistics_text.h"

namespace esim::inline characterise {
namespace {

/// A contrast as makers give it: by how much the light changes, %.
std::string contrast_text(double contrast) {
  return std::isnan(contrast) ? "-" : fmt::format("{:.1f} %", 100 * std::expm1(contrast));
}
std::string fraction_text(double value) { return std::isnan(value) ? "-" : fmt::format("{:.3f}", value); }
std::string time_text(double seconds) { return std::isfinite(seconds) ? format_duration(seconds) : "-"; }
std::string hertz_text(double value) { return std::isfinite(value) ? fmt::format("{:.4g} Hz", value) : "-"; }

using Cells = std::vector<std::string>;

struct LevelRow {
  const char* title;
  std::string (*text)(const LightLevel&);
};

constexpr std::array<LevelRow, 13> kLevelRows{{
    {"threshold, ON (change of the light)", [](const LightLevel& l) { return contrast_text(l.on.threshold); }},
    {"threshold, ON (ln)", [](const LightLevel& l) { return fraction_text(l.on.threshold); }},
    {"threshold, OFF (ln)", [](const LightLevel& l) { return fraction_text(l.off.threshold); }},
    {"threshold of ramps, ON (ln)", [](const LightLevel& l) { return fraction_text(l.on_ramp.threshold); }},
    {"width of the S-curve, ON (ln)", [](const LightLevel& l) { return fraction_text(l.on.width); }},
    {"non-uniformity, ON (ln)", [](const LightLevel& l) { return fraction_text(l.on.non_uniformity); }},
    {"non-uniformity, OFF (ln)", [](const LightLevel& l) { return fraction_text(l.off.non_uniformity); }},
    {"latency of doubled light", [](const LightLevel& l) { return time_text(l.latency_s); }},
    {"jitter of this latency", [](const LightLevel& l) { return time_text(l.jitter_s); }},
    {"bandwidth, -3 dB", [](const LightLevel& l) { return hertz_text(l.bandwidth_hz); }},
    {"background, ON, of a pixel", [](const LightLevel& l) { return hertz_text(l.noise_on_hz); }},
    {"background, OFF, of a pixel", [](const LightLevel& l) { return hertz_text(l.noise_off_hz); }},
    {"background that alternates", [](const LightLevel& l) { return fraction_text(l.alternating); }},
}};

std::string table_text(const std::vector<Cells>& rows) {
  std::vector<std::size_t> widths;
  for (const Cells& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  std::string text;
  for (const Cells& row : rows) {
    std::string line = "  ";
    for (std::size_t i = 0; i < row.size(); ++i)
      line += i == 0 ? fmt::format("{:<{}}", row[i], widths[i]) : fmt::format("   {:>{}}", row[i], widths[i]);
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

nlohmann::ordered_json number(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

nlohmann::ordered_json to_json(const SCurve& curve) {
  nlohmann::ordered_json fractions = nlohmann::ordered_json::array();
  for (const double fraction : curve.fractions) fractions.push_back(number(fraction));
  return {{"contrasts", curve.contrasts},
          {"fractions", fractions},
          {"threshold", number(curve.threshold)},
          {"width", number(curve.width)},
          {"non_uniformity", number(curve.non_uniformity)}};
}

}  // namespace

std::string describe(const std::vector<Characterisation>& sensors) {
  std::vector<Cells> rows(1, Cells{""});
  for (const Characterisation& sensor : sensors) {
    for (const LightLevel& level : sensor.levels)
      rows[0].push_back((sensors.size() > 1 ? sensor.name + ", " : "") +
                        (sensor.in_lux ? fmt::format("{:g} lux", level.lux) : fmt::format("E = {:g}", level.lux)));
  }
  for (const LevelRow& row : kLevelRows) {
    rows.push_back({row.title});
    for (const Characterisation& sensor : sensors) {
      for (const LightLevel& level : sensor.levels) rows.back().push_back(row.text(level));
    }
  }
  std::string text;
  if (sensors.size() == 1) text += sensors.front().name + "\n";
  text += table_text(rows) + "\n";
  rows = {{""},
          {"lowest light, where half of the pixels see it double"},
          {"dynamic range"},
          {"refractory period"},
          {"peak rate, all pixels flickering"}};
  for (const Characterisation& s : sensors) {
    rows[0].push_back(s.name);
    rows[1].push_back(std::isnan(s.cutoff_lux) ? "-"
                      : s.in_lux               ? fmt::format("{:.3g} lux", s.cutoff_lux)
                                               : fmt::format("E = {:.3g}", s.cutoff_lux));
    rows[2].push_back(std::isnan(s.cutoff_lux) || !s.in_lux ? "-" : fmt::format("{:.0f} dB", s.dynamic_range_db()));
    rows[3].push_back(s.refractory_s < 1e-6 ? "< 1 us" : time_text(s.refractory_s));
    rows[4].push_back(format_rate(s.peak_rate_hz));
  }
  text += table_text(rows);
  for (const Characterisation& s : sensors) {
    const std::string name = sensors.size() > 1 ? s.name + ": " : "";
    for (const LightLevel& level : s.levels) {
      for (const std::string& note : level.notes) text += fmt::format("\n{}{}", name, note);
    }
    for (const std::string& note : s.notes) text += fmt::format("\n{}{}", name, note);
  }
  return text.back() == '\n' ? text : text + "\n";
}

std::string to_json(const std::vector<Characterisation>& sensors) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const Characterisation& s : sensors) {
    nlohmann::ordered_json levels = nlohmann::ordered_json::array();
    for (const LightLevel& l : s.levels) {
      levels.push_back({{s.in_lux ? "lux" : "irradiance", l.lux},
                        {"on", to_json(l.on)},
                        {"off", to_json(l.off)},
                        {"on_ramp", to_json(l.on_ramp)},
                        {"latency_s", number(l.latency_s)},
                        {"jitter_s", number(l.jitter_s)},
                        {"bandwidth_hz", number(l.bandwidth_hz)},
                        {"background_on_hz", number(l.noise_on_hz)},
                        {"background_off_hz", number(l.noise_off_hz)},
                        {"background_alternating", number(l.alternating)},
                        {"notes", l.notes}});
    }
    json.push_back({{"sensor", s.name},
                    {"levels", levels},
                    {s.in_lux ? "cutoff_lux" : "cutoff_irradiance", number(s.cutoff_lux)},
                    {"dynamic_range_db", s.in_lux ? number(s.dynamic_range_db()) : nlohmann::ordered_json(nullptr)},
                    {"refractory_period_s", number(s.refractory_s)},
                    {"peak_rate_hz", number(s.peak_rate_hz)},
                    {"notes", s.notes}});
  }
  return json.dump(2) + "\n";
}

}  // namespace esim::inline characterise
