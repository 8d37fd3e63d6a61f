#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "esim/files/markdown_table.h"
#include "esim/fit/sensor_fit.h"

namespace esim::inline fit {
namespace {

std::string interval_text(const Estimate& e) {
  return e.low == e.high ? "" : fmt::format("{:.4g} to {:.4g}", e.low, e.high);
}

std::string value_text(const Estimate& e) {
  return fmt::format("{:.4g}{}{}", e.value, e.unit.empty() ? "" : " ", e.unit);
}

std::string found_table(const SensorFit& fit) {
  std::vector<std::vector<std::string>> rows{{"parameter", "value", "95 % interval", "found from"}};
  for (const auto* estimates : {&fit.estimates, &fit.observations}) {
    for (const Estimate& e : *estimates) {
      if (e.determined()) rows.push_back({e.name, value_text(e), interval_text(e), e.source});
    }
  }
  return rows.size() > 1 ? markdown_table(rows) : "No parameter is determined.\n";
}

std::string unknown_list(const SensorFit& fit) {
  std::string text;
  for (const Estimate& e : fit.estimates) {
    if (!e.determined()) text += fmt::format("- {}: not determined, because {}\n", e.name, e.reason);
  }
  return text;
}

std::string recordings_table(const SensorFit& fit) {
  std::vector<std::vector<std::string>> rows{{"recording", "use", "events", "images", "duration"}};
  for (const FittedRecording& r : fit.recordings) {
    rows.push_back({r.path, r.use, fmt::format("{}", r.events), r.images > 0 ? fmt::format("{}", r.images) : "",
                    fmt::format("{:.4g} s", r.duration_s)});
  }
  return markdown_table(rows);
}

std::string notes_list(const SensorFit& fit) {
  std::string text;
  for (const std::string& note : fit.notes) text += "- " + note + "\n";
  return text;
}

nlohmann::json json_of(const Estimate& e) {
  nlohmann::json json{{"name", e.name}, {"unit", e.unit}};
  if (e.determined()) {
    json["value"] = e.value, json["low"] = e.low, json["high"] = e.high, json["source"] = e.source;
  } else {
    json["value"] = nullptr, json["reason"] = e.reason;
  }
  return json;
}

}  // namespace

std::string to_yaml(const SensorFit& fit) {
  std::string text = "# A sensor fitted to recordings by `esim fit`. Intervals contain 95 %.\nevent_camera:\n";
  text += "  preset: " + fit.base + "\n";
  std::string section;
  for (const Estimate& e : fit.estimates) {
    const std::size_t dot = e.name.find('.');
    const std::string parent = dot == std::string::npos ? "" : e.name.substr(0, dot);
    const std::string name = dot == std::string::npos ? e.name : e.name.substr(dot + 1);
    if (!e.determined() || !parent.empty()) continue;
    text += fmt::format("  {}: {:.6g}", name, e.value);
    text += e.low == e.high ? "\n" : fmt::format("  # {}\n", interval_text(e));
  }
  for (const char* parent : {"circuit", "readout"}) {
    std::string lines;
    for (const Estimate& e : fit.estimates) {
      if (!e.determined() || !e.name.starts_with(std::string(parent) + ".")) continue;
      lines += fmt::format("    {}: {:.6g}", e.name.substr(std::string(parent).size() + 1), e.value);
      lines += e.low == e.high ? "\n" : fmt::format("  # {}\n", interval_text(e));
    }
    if (!lines.empty()) text += fmt::format("  {}:\n{}", parent, lines);
  }
  const std::string unknown = unknown_list(fit);
  if (!unknown.empty()) {
    text += fmt::format("  # These are as in {}:\n", fit.base);
    std::size_t from = 0;
    for (std::size_t to = unknown.find('\n'); to != std::string::npos; from = to + 1, to = unknown.find('\n', from))
      text += "  # " + unknown.substr(from, to - from) + "\n";
  }
  return text;
}

std::string describe(const SensorFit& fit) {
  std::string text = found_table(fit);
  const std::string unknown = unknown_list(fit), notes = notes_list(fit);
  if (!unknown.empty()) text += "\n" + unknown;
  if (!notes.empty()) text += "\n" + notes;
  return text;
}

std::string to_markdown(const SensorFit& fit, const std::string& figure) {
  std::string text =
      fmt::format("# A fitted sensor\n\n{} x {} px. What the recordings do not determine is as in {}.\n\n",
                  fit.sensor.width, fit.sensor.height, fit.base);
  text += found_table(fit);
  if (const std::string unknown = unknown_list(fit); !unknown.empty()) text += "\n## Not determined\n\n" + unknown;
  if (!figure.empty())
    text += fmt::format(
        "\n## Distributions\n\nBars: measured. Lines: fitted.\n\n![Measured and fitted distributions]({})\n", figure);
  text += "\n## Recordings\n\n" + recordings_table(fit);
  if (const std::string notes = notes_list(fit); !notes.empty()) text += "\n" + notes;
  return text;
}

std::string to_json(const SensorFit& fit) {
  nlohmann::json json{
      {"base", fit.base}, {"width", fit.sensor.width}, {"height", fit.sensor.height}, {"notes", fit.notes}};
  for (const Estimate& e : fit.estimates) json["parameters"].push_back(json_of(e));
  json["observations"] = nlohmann::json::array();
  for (const Estimate& e : fit.observations) json["observations"].push_back(json_of(e));
  for (const FittedRecording& r : fit.recordings) {
    json["recordings"].push_back(
        {{"path", r.path}, {"use", r.use}, {"events", r.events}, {"images", r.images}, {"duration_s", r.duration_s}});
  }
  return json.dump(2) + "\n";
}

}  // namespace esim::inline fit
