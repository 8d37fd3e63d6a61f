#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "esim/evaluate/realism/realism.h"
#include "esim/files/markdown_table.h"
#include "esim/stats/statistics_text.h"

namespace esim::inline evaluate {
namespace {

using Cells = std::vector<std::string>;
using Kind = ComparedStatistic::Kind;

std::string value_text(double value, const std::string& unit) {
  if (std::isnan(value)) return "-";
  if (unit == "s") return format_duration(value);
  if (unit == "1/s") return format_rate(value);
  return fmt::format("{:.3g}{}{}", value, unit.empty() ? "" : " ", unit);
}

std::string cell_text(const ComparedStatistic& s) {
  std::string text = s.kind == Kind::distribution ? "KS " + value_text(s.distance, "") : value_text(s.second, s.unit);
  if (!std::isnan(s.deviations))
    text += std::isinf(s.deviations) ? " (differs)" : fmt::format(" ({:.1f})", s.deviations);
  return text;
}

std::string clip_table(const std::vector<const ClipResult*>& results) {
  std::vector<Cells> rows{{results.front()->clip, "real"}};
  for (const ClipResult* result : results) rows[0].push_back(result->model);
  const std::vector<ComparedStatistic>& first = results.front()->statistics;
  for (std::size_t i = 0; i < first.size(); ++i) {
    rows.push_back(
        {first[i].name, first[i].kind == Kind::distribution ? "" : value_text(first[i].first, first[i].unit)});
    for (const ClipResult* result : results) rows.back().push_back(cell_text(result->statistics[i]));
  }
  rows.push_back({"sum of deviations", ""});
  for (const ClipResult* result : results) rows.back().push_back(fmt::format("{:.0f}", result->sum_of_deviations()));
  return markdown_table(rows);
}

std::string noise_table(const std::vector<const NoiseResult*>& results) {
  std::vector<Cells> rows{{results.front()->recording, "ON per pixel (real)", "OFF per pixel (real)", "KS of ON counts",
                           "of OFF counts", "of ON intervals", "of OFF intervals"}};
  for (const NoiseResult* r : results) {
    rows.push_back({r->model, fmt::format("{:.3g} ({:.3g})", r->on, r->real_on),
                    fmt::format("{:.3g} ({:.3g})", r->off, r->real_off), value_text(r->ks_counts_on, ""),
                    value_text(r->ks_counts_off, ""), value_text(r->ks_intervals_on, ""),
                    value_text(r->ks_intervals_off, "")});
  }
  return markdown_table(rows);
}

/// The tables of successive results of the same recording.
template <typename Result, typename Name, typename Table>
std::string tables_of(const std::vector<Result>& results, const Name& name, const Table& table) {
  std::string text;
  for (std::size_t i = 0; i < results.size();) {
    std::vector<const Result*> same;
    for (; i < results.size() && (same.empty() || name(results[i]) == name(*same.front())); ++i)
      same.push_back(&results[i]);
    text += table(same) + "\n";
  }
  return text;
}

std::string frames_text(const FrameTimes& frames) {
  const auto ms = [](TimeNs t) { return 1e3 * to_seconds(t); };
  return fmt::format(
      "{}, {}", frames.period ? fmt::format("frames every {:.1f} ms", ms(*frames.period)) : "one frame",
      frames.exposure() ? fmt::format("exposed for {:.1f} ms", ms(*frames.exposure())) : "with an unknown exposure");
}

nlohmann::ordered_json number(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

nlohmann::ordered_json seconds(const std::optional<TimeNs>& time) {
  return time ? nlohmann::ordered_json(to_seconds(*time)) : nlohmann::ordered_json(nullptr);
}

}  // namespace

std::string describe(const RealismEvaluation& evaluation) {
  std::string text;
  for (const ClipFrames& each : evaluation.frames)
    text += fmt::format("{}: {} (found by bursts of events)\n", each.clip, frames_text(each.frames));
  if (!text.empty()) text += "\n";
  for (const FittedModel& fitted : evaluation.fitted)
    text += fmt::format("{}{} ({} simulations)\n\n{}\n", fitted.model, kFitted, fitted.fit.simulations,
                        describe(fitted.fit));
  text += tables_of(
      evaluation.clips, [](const ClipResult& r) { return r.clip; }, clip_table);
  text += tables_of(
      evaluation.noise, [](const NoiseResult& r) { return r.recording; }, noise_table);
  if (!text.empty()) text.pop_back();
  return text;
}

std::string to_json(const RealismEvaluation& evaluation) {
  nlohmann::ordered_json clips = nlohmann::ordered_json::array(), noise = clips;
  for (const ClipResult& r : evaluation.clips) {
    nlohmann::ordered_json statistics = nlohmann::ordered_json::array();
    for (const ComparedStatistic& s : r.statistics) {
      statistics.push_back({{"name", s.name},
                            {"unit", s.unit},
                            {"real", number(s.first)},
                            {"model", number(s.second)},
                            {"distance", number(s.distance)},
                            {"low", number(s.low)},
                            {"high", number(s.high)},
                            {"deviations", number(s.deviations)},
                            {"distinguishes", s.distinguishes()}});
    }
    clips.push_back({{"clip", r.clip},
                     {"model", r.model},
                     {"statistics", statistics},
                     {"sum_of_deviations", r.sum_of_deviations()},
                     {"seconds", r.seconds}});
  }
  for (const NoiseResult& r : evaluation.noise) {
    noise.push_back({{"recording", r.recording},
                     {"model", r.model},
                     {"lux", r.lux},
                     {"on_per_pixel", r.on},
                     {"off_per_pixel", r.off},
                     {"real_on_per_pixel", r.real_on},
                     {"real_off_per_pixel", r.real_off},
                     {"ks_counts_on", number(r.ks_counts_on)},
                     {"ks_counts_off", number(r.ks_counts_off)},
                     {"ks_intervals_on", number(r.ks_intervals_on)},
                     {"ks_intervals_off", number(r.ks_intervals_off)}});
  }
  nlohmann::ordered_json fitted = nlohmann::ordered_json::array();
  for (const FittedModel& f : evaluation.fitted) {
    nlohmann::ordered_json parameters = nlohmann::ordered_json::array();
    for (const Estimate& e : f.fit.estimates) {
      parameters.push_back({{"name", e.name},
                            {"unit", e.unit},
                            {"value", number(e.value)},
                            {"low", number(e.low)},
                            {"high", number(e.high)},
                            {"reason", e.reason}});
    }
    fitted.push_back({{"model", f.model}, {"simulations", f.fit.simulations}, {"parameters", parameters}});
  }
  nlohmann::ordered_json frames = nlohmann::ordered_json::array();
  for (const ClipFrames& each : evaluation.frames) {
    frames.push_back({{"clip", each.clip},
                      {"start_s", seconds(each.frames.start)},
                      {"end_s", seconds(each.frames.end)},
                      {"period_s", seconds(each.frames.period)},
                      {"exposure_s", seconds(each.frames.exposure())}});
  }
  return nlohmann::ordered_json{{"frames", frames}, {"fitted", fitted}, {"clips", clips}, {"noise", noise}}.dump(2) +
         "\n";
}

}  // namespace esim::inline evaluate
