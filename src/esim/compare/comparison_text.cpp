#include "esim/compare/comparison_text.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "esim/files/number_text.h"
#include "esim/stats/statistics_text.h"

namespace esim::inline compare {
namespace {

using Kind = ComparedStatistic::Kind;

std::string value_text(double value, const std::string& unit) {
  if (std::isnan(value)) return "-";
  if (unit == "s") return format_duration(value);
  if (unit == "1/s") return format_rate(value);
  return fmt::format("{:.4g}{}{}", value, unit.empty() ? "" : " ", unit);
}

std::string distance_text(const ComparedStatistic& s) {
  if (std::isnan(s.distance)) return "-";
  const char* const format = s.kind == Kind::ratio ? "x {:.3g}" : s.kind == Kind::difference ? "{:+.3g}" : "KS {:.3g}";
  std::string text = fmt::format(fmt::runtime(format), s.distance);
  if (!std::isnan(s.low)) text += fmt::format(" ({:.3g} to {:.3g})", s.low, s.high);
  return text;
}

std::string deviations_text(const ComparedStatistic& s) {
  if (std::isnan(s.deviations)) return "";
  if (std::isinf(s.deviations)) return "differs";
  return fmt::format("{:.1f}{}", s.deviations, s.distinguishes() ? "  differs" : "");
}

std::string verdict_of(const std::vector<ComparedStatistic>& statistics) {
  constexpr std::size_t kNamed = 5;
  const auto found = distinguishing(statistics);
  if (found.empty()) {
    const bool known = std::any_of(statistics.begin(), statistics.end(),
                                   [](const ComparedStatistic& s) { return !std::isnan(s.deviations); });
    return known ? "not distinguishable by these statistics" : "too few events to tell";
  }
  std::string text = "distinguishable by: ";
  for (std::size_t i = 0; i < std::min(kNamed, found.size()); ++i) text += (i > 0 ? "; " : "") + found[i]->name;
  if (found.size() > kNamed) text += fmt::format("; and {} more", found.size() - kNamed);
  return text;
}

std::string scene_text(const SceneComparison& scene) {
  const EventComparison& e = scene.events;
  const auto percent = [](std::int64_t part, std::int64_t all) {
    return all > 0 ? fmt::format("{:.1f} %", 100 * static_cast<double>(part) / static_cast<double>(all)) : "-";
  };
  const auto count = [](std::int64_t n) { return grouped(static_cast<std::uint64_t>(n)); };
  std::string text = fmt::format("\nevents of the same scene, {:.6f} s to {:.6f} s\n", to_seconds(scene.span.start),
                                 to_seconds(scene.span.end));
  text += fmt::format("  {:<22}{} ({} of A)\n", "matched", count(e.matched), percent(e.matched, e.reference));
  text += fmt::format("  {:<22}{} ({} of A)\n", "missing in B", count(e.missing), percent(e.missing, e.reference));
  text += fmt::format("  {:<22}{} ({} of B)\n", "only in B", count(e.spurious), percent(e.spurious, e.events));
  if (e.matched > 0) {
    text += fmt::format("  {:<22}median {}, 95 % below {}\n", "time error", format_duration(e.median_s),
                        format_duration(e.p95_s));
  }
  text += fmt::format("  {:<22}{} (0: equal, 1: nothing in common)\n", "time surfaces", value_text(scene.surfaces, ""));
  text += fmt::format("  {:<22}{}\n", "voxel grids", value_text(scene.voxels, ""));
  return text;
}

nlohmann::ordered_json number(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

}  // namespace

std::string describe(const RecordingComparison& comparison) {
  std::array<std::size_t, 4> widths{0, 1, 1, 12};
  std::vector<std::array<std::string, 5>> rows;
  rows.push_back({"", "A", "B", "B against A", "deviations"});
  for (const ComparedStatistic& s : comparison.statistics) {
    rows.push_back({s.name, s.kind == Kind::distribution ? "" : value_text(s.first, s.unit),
                    s.kind == Kind::distribution ? "" : value_text(s.second, s.unit), distance_text(s),
                    deviations_text(s)});
  }
  for (const auto& row : rows) {
    for (std::size_t i = 0; i < widths.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  std::string text = fmt::format("A: {}\nB: {}\nthe first {} of both; intervals contain 95 %\n\n",
                                 comparison.first_name, comparison.second_name, format_duration(comparison.compared_s));
  for (const auto& row : rows) {
    std::string line = "  ";
    for (std::size_t i = 0; i < row.size(); ++i)
      line += i < widths.size() ? fmt::format("{:<{}}  ", row[i], widths[i]) : row[i];
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  text += "\n" + verdict_of(comparison.statistics) + "\n";
  if (comparison.scene) text += scene_text(*comparison.scene);
  return text;
}

std::string to_json(const RecordingComparison& comparison) {
  nlohmann::ordered_json json{{"a", comparison.first_name},           {"b", comparison.second_name},
                              {"compared_s", comparison.compared_s},  {"events_a", comparison.first.events},
                              {"events_b", comparison.second.events}, {"statistics", nlohmann::ordered_json::array()}};
  constexpr std::array<const char*, 3> kKinds{"ratio", "difference", "ks"};
  for (const ComparedStatistic& s : comparison.statistics) {
    json["statistics"].push_back({{"name", s.name},
                                  {"unit", s.unit},
                                  {"a", number(s.first)},
                                  {"b", number(s.second)},
                                  {kKinds[static_cast<std::size_t>(s.kind)], number(s.distance)},
                                  {"low", number(s.low)},
                                  {"high", number(s.high)},
                                  {"deviations", number(s.deviations)},
                                  {"distinguishes", s.distinguishes()}});
  }
  json["distinguishable_by"] = nlohmann::ordered_json::array();
  for (const ComparedStatistic* s : distinguishing(comparison.statistics))
    json["distinguishable_by"].push_back(s->name);
  if (comparison.scene) {
    const SceneComparison& scene = *comparison.scene;
    json["same_scene"] = {{"start_s", to_seconds(scene.span.start)},
                          {"end_s", to_seconds(scene.span.end)},
                          {"matched", scene.events.matched},
                          {"missing", scene.events.missing},
                          {"only_in_b", scene.events.spurious},
                          {"median_time_error_s", number(scene.events.median_s)},
                          {"p95_time_error_s", number(scene.events.p95_s)},
                          {"time_surfaces", number(scene.surfaces)},
                          {"voxel_grids", number(scene.voxels)}};
  }
  return json.dump(2) + "\n";
}

}  // namespace esim::inline compare
