#include "esim/evaluate/report/evaluation_text.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace esim::inline evaluate {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const TimeSpan& span) { return {to_seconds(span.start), to_seconds(span.end)}; }

Json json_of(const EventComparison& events) {
  return {
      {"reference", events.reference},
      {"events", events.events},
      {"count_ratio", events.count_ratio()},
      {"active_pixels", events.active_pixels},
      {"identical_pixels", events.identical_pixels},
      {"identical_fraction", events.identical_fraction()},
      {"matched", events.matched},
      {"missing", events.missing},
      {"spurious", events.spurious},
      {"timing_error_median_s", events.median_s},
      {"timing_error_p95_s", events.p95_s},
      {"timing_error_percentiles_s", events.quantiles_s},
  };
}

Json json_of(const Window& window, const WindowResult& result) {
  const BrightnessError& brightness = result.brightness;
  Json json = {
      {"window", window.name},
      {"samples_per_s", result.samples_per_s},
      {"frame_equivalents_per_s", result.frame_equivalents_per_s},
      {"rmse_mean", brightness.mean_rmse},
      {"rmse_of_pixels", brightness.rmse},
      {"error_mean_abs", brightness.mean_abs},
      {"error_p99_abs", brightness.p99_abs},
      {"error_max_abs", brightness.max_abs},
      {"steps", brightness.steps},
      {"steps_above_threshold", brightness.large_steps},
  };
  for (std::size_t i = 0; i < kPlaceNames.size(); ++i) {
    const auto& [squares, values] = brightness.places[i];
    if (values > 0) json["by_place"][kPlaceNames[i]] = {{"values", values}, {"sum_of_squares", squares}};
  }
  if (result.events) json["events"] = json_of(*result.events);
  return json;
}

Json json_of(const SamplingEvaluation& evaluation, const SchemeResult& scheme) {
  Json windows = Json::array();
  for (std::size_t i = 0; i < scheme.windows.size(); ++i)
    windows.push_back(json_of(evaluation.windows[i], scheme.windows[i]));
  return {
      {"scheme", scheme.text},
      {"family", scheme.family},
      {"windows", windows},
      {"samples_held_to_max_rate", scheme.held_to_max_rate},
      {"events", scheme.events},
      {"wall_s", scheme.wall_seconds},
      {"wall_s_by_stage",
       {{"render", scheme.seconds.render}, {"sampling", scheme.seconds.sampling}, {"events", scheme.seconds.events}}},
      {"real_time_factor", scheme.real_time_factor},
  };
}

Json windows_json(const SamplingEvaluation& evaluation) {
  Json windows = Json::array();
  for (std::size_t i = 0; i < evaluation.windows.size(); ++i) {
    const Window& window = evaluation.windows[i];
    Json json = {
        {"name", window.name}, {"span_s", json_of(window.span)}, {"mean_motion_px_per_s", window.mean_px_per_s}};
    if (i < evaluation.event_spans.size()) {
      json["event_span_s"] = json_of(evaluation.event_spans[i]);
      json["event_span_mean_motion_px_per_s"] = evaluation.motion.mean(evaluation.event_spans[i]);
      json["reference_events"] = evaluation.reference_events[i];
    }
    windows.push_back(std::move(json));
  }
  return windows;
}

Json optional_json(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

}  // namespace

std::string to_json(const SamplingEvaluation& evaluation) {
  const SamplingEvaluationOptions& options = evaluation.options;
  Json schemes = Json::array(), goals = Json::array();
  for (const SchemeResult& scheme : evaluation.schemes) schemes.push_back(json_of(evaluation, scheme));
  for (const GoalCost& goal : evaluation.goals) {
    goals.push_back({{"family", goal.family},
                     {"frame_equivalents_per_s", optional_json(goal.frame_equivalents_per_s)},
                     {"samples_per_s", optional_json(goal.samples_per_s)}});
  }
  const Json json = {
      {"status", "complete"},
      {"renderer", evaluation.renderer},
      {"width", evaluation.width},
      {"height", evaluation.height},
      {"span_s", json_of(evaluation.span)},
      {"contrast_threshold", evaluation.contrast_threshold},
      {"log_eps", evaluation.log_eps},
      {"pixels", evaluation.pixels.size()},
      {"truth_rate_hz", options.truth_rate_hz},
      {"truth_rays", options.truth_rays},
      {"event_reference_rate_hz", options.event_rate_hz},
      {"motion",
       {{"rate_hz", evaluation.motion.rate_hz},
        {"mean_px_per_s", evaluation.motion.mean_px_per_s},
        {"max_px_per_s", evaluation.motion.max_px_per_s},
        {"fastest_turn_deg_per_s", evaluation.motion.fastest_turn_deg_per_s}}},
      {"windows", windows_json(evaluation)},
      {"schemes", schemes},
      {"rmse_goal", options.rmse_goal},
      {"cost_at_goal", goals},
      {"threads", evaluation.threads},
      {"truth_s", evaluation.truth_seconds},
      {"event_reference_s", evaluation.event_reference_seconds},
      {"wall_s", evaluation.wall_seconds},
  };
  return json.dump(1) + "\n";
}

std::string text_header(const SamplingEvaluation& evaluation) {
  std::string text = fmt::format("{:<28}{:>10}{:>10}", "scheme", "frames/s", "renders/s");
  for (const Window& window : evaluation.windows) text += fmt::format("{:>12}", "RMSE " + window.name);
  if (!evaluation.event_spans.empty())
    text += fmt::format("{:>9}{:>8}{:>11}{:>9}", "events", "same", "median us", "p95 us");
  return text + fmt::format("{:>8}\n", "RTF");
}

std::string text_line(const SchemeResult& scheme) {
  const WindowResult& all = scheme.windows.back();
  std::string text =
      fmt::format("{:<28}{:>10.0f}{:>10.0f}", scheme.text, all.frame_equivalents_per_s, all.samples_per_s);
  for (const WindowResult& window : scheme.windows) text += fmt::format("{:>12.5f}", window.brightness.mean_rmse);
  if (all.events) {
    text += fmt::format("{:>9.3f}{:>8.3f}{:>11.1f}{:>9.1f}", all.events->count_ratio(),
                        all.events->identical_fraction(), all.events->median_s * 1e6, all.events->p95_s * 1e6);
  }
  return text + fmt::format("{:>8.3f}\n", scheme.real_time_factor);
}

std::string goal_text(const SamplingEvaluation& evaluation) {
  std::string text;
  for (const GoalCost& goal : evaluation.goals) {
    text += goal.samples_per_s ? fmt::format("RMSE <= {:g}: {} needs {:.0f} frame-equivalents/s in {:.0f} renders/s\n",
                                             evaluation.options.rmse_goal, goal.family, *goal.frame_equivalents_per_s,
                                             *goal.samples_per_s)
                               : fmt::format("RMSE <= {:g}: the curve of {} does not cross it\n",
                                             evaluation.options.rmse_goal, goal.family);
  }
  return text;
}

}  // namespace esim::inline evaluate
