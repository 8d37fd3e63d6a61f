#include "esim/evaluate/report/report_markdown.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace esim::inline evaluate {
namespace {

std::string span_text(const TimeSpan& span) {
  return fmt::format("{:.3f} to {:.3f}", to_seconds(span.start), to_seconds(span.end));
}

std::string setup(const SamplingEvaluation& e) {
  const SamplingEvaluationOptions& options = e.options;
  std::string text = fmt::format(
      "- Scene: renderer {}, {} x {} px, {:.3f} s. Motion field: mean {:.0f} px/s, maximum {:.0f} px/s; the camera "
      "turns at up to {:.0f} deg/s.\n"
      "- Brightness: L = ln(E + {:g}) of {} pixels, compared with renderings at {:g} Hz{}.\n",
      e.renderer, e.width, e.height, to_seconds(e.span.end - e.span.start), e.motion.mean(e.span),
      e.motion.max_px_per_s, e.motion.fastest_turn_deg_per_s, e.log_eps, e.pixels.size(), options.truth_rate_hz,
      options.truth_rays > 0 ? fmt::format(", with {} rays per pixel at edges", options.truth_rays) : "");
  if (!e.event_spans.empty()) {
    text += fmt::format(
        "- Events: all pixels of an ideal sensor with C = {:g}, compared with uniform sampling at {:g} Hz.\n",
        e.contrast_threshold, options.event_rate_hz);
  }
  return text + fmt::format("- {} threads; the evaluation took {:.0f} s.\n", e.threads, e.wall_seconds);
}

std::string windows_table(const SamplingEvaluation& e) {
  const bool events = !e.event_spans.empty();
  std::string text =
      events ? "| window | time, s | motion field, px/s | time of the compared events, s | motion field in it, px/s | "
               "reference events |\n|---|---|---|---|---|---|\n"
             : "| window | time, s | motion field, px/s |\n|---|---|---|\n";
  for (std::size_t i = 0; i < e.windows.size(); ++i) {
    const Window& window = e.windows[i];
    text += fmt::format("| {} | {} | {:.0f} |", window.name, span_text(window.span), window.mean_px_per_s);
    if (events) {
      text += fmt::format(" {} | {:.0f} | {} |", span_text(e.event_spans[i]), e.motion.mean(e.event_spans[i]),
                          e.reference_events[i]);
    }
    text += "\n";
  }
  return text;
}

std::string brightness_table(const SamplingEvaluation& e, std::size_t w) {
  std::string text =
      "| scheme | frame-equivalents/s | renders/s | mean RMSE | mean error | 99 % | maximum | steps above C, % |\n"
      "|---|---|---|---|---|---|---|---|\n";
  for (const SchemeResult& scheme : e.schemes) {
    const WindowResult& result = scheme.windows[w];
    const BrightnessError& b = result.brightness;
    const double large = b.steps > 0 ? 100.0 * static_cast<double>(b.large_steps) / static_cast<double>(b.steps) : 0.0;
    text += fmt::format("| {} | {:.0f} | {:.0f} | {:.5f} | {:.5f} | {:.4f} | {:.3f} | {:.3f} |\n", scheme.text,
                        result.frame_equivalents_per_s, result.samples_per_s, b.mean_rmse, b.mean_abs, b.p99_abs,
                        b.max_abs, large);
  }
  return text;
}

/// The squared errors by place; empty unless all pixels were compared.
std::string places_table(const SamplingEvaluation& e, std::size_t w) {
  const auto& first = e.schemes.front().windows[w].brightness;
  if (first.places[0].values == 0) return {};
  std::string text = "\n| percentage of the squared error (root mean square) |", line = "\n|---|",
              pixels = "\n| pixels, % |";
  const auto percent = [](double part, double all) { return all > 0 ? 100 * part / all : 0.0; };
  for (std::size_t i = 0; i < kPlaceNames.size(); ++i) {
    text += fmt::format(" {} |", kPlaceNames[i]), line += "---|";
    pixels += fmt::format(" {:.1f} |",
                          percent(static_cast<double>(first.places[i].values), static_cast<double>(first.values)));
  }
  text += line + pixels + "\n";
  for (const SchemeResult& scheme : e.schemes) {
    const auto& places = scheme.windows[w].brightness.places;
    double all = 0;
    for (const PlaceError& place : places) all += place.squares;
    text += fmt::format("| {} |", scheme.text);
    for (const PlaceError& place : places) {
      const double count = static_cast<double>(std::max<std::int64_t>(1, place.values));
      text += fmt::format(" {:.0f} ({:.4f}) |", percent(place.squares, all), std::sqrt(place.squares / count));
    }
    text += "\n";
  }
  return text;
}

std::string events_table(const SamplingEvaluation& e, std::size_t w) {
  std::string text =
      "| scheme | events / reference | same sequence, % of pixels | median, us | 95 %, us | missing, % | spurious, % "
      "|\n"
      "|---|---|---|---|---|---|---|\n";
  for (const SchemeResult& scheme : e.schemes) {
    const EventComparison& c = *scheme.windows[w].events;
    const double reference = static_cast<double>(std::max<std::int64_t>(1, c.reference));
    text += fmt::format("| {} | {:.3f} | {:.1f} | {:.2f} | {:.1f} | {:.2f} | {:.2f} |\n", scheme.text, c.count_ratio(),
                        100 * c.identical_fraction(), c.median_s * 1e6, c.p95_s * 1e6,
                        100 * static_cast<double>(c.missing) / reference,
                        100 * static_cast<double>(c.spurious) / reference);
  }
  return text;
}

std::string speed_table(const SamplingEvaluation& e) {
  std::string text =
      "| scheme | rendering, s | sampling, s | events, s | total, s | real-time factor | events simulated |\n"
      "|---|---|---|---|---|---|---|\n";
  for (const SchemeResult& scheme : e.schemes) {
    const StageSeconds& s = scheme.seconds;
    text += fmt::format("| {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.3f} | {} |\n", scheme.text, s.render, s.sampling,
                        s.events, scheme.wall_seconds, scheme.real_time_factor, scheme.events);
  }
  return text;
}

std::string goals_table(const SamplingEvaluation& e) {
  std::string text = fmt::format(
      "| family | frame-equivalents/s for a mean RMSE of {:g} | renders/s |\n|---|---|---|\n", e.options.rmse_goal);
  for (const GoalCost& goal : e.goals) {
    text += goal.samples_per_s ? fmt::format("| {} | {:.0f} | {:.0f} |\n", goal.family, *goal.frame_equivalents_per_s,
                                             *goal.samples_per_s)
                               : fmt::format("| {} | not crossed | |\n", goal.family);
  }
  return text;
}

}  // namespace

std::string to_markdown(const SamplingEvaluation& e) {
  const bool events = !e.event_spans.empty();
  std::string text = "# Evaluation of sampling schemes\n\n" + setup(e) + "\n" + windows_table(e) +
                     "\n![Motion over time](motion.png)\n\n## Cost at equal error\n\n" + goals_table(e) +
                     "\nThe cost at which the curve of a family first falls below this RMSE in the window \"all\". The "
                     "curve is linear in logarithms between the schemes. The paper reports 1260 (flow) and 2060 "
                     "(uniform) for an RMSE of 0.01 in its own motion.\n\n"
                     "![RMSE against cost](rmse_over_cost.png)\n\n![RMSE of the pixels](rmse.png)\n";
  for (std::size_t w = e.windows.size(); w-- > 0;) {
    text += fmt::format("\n## Window {}\n\n{}", e.windows[w].name, brightness_table(e, w) + places_table(e, w));
    if (events) text += "\n" + events_table(e, w);
  }
  if (events) text += "\n![Timing of events](timing.png)\n";
  text += "\n## Speed\n\nWall-clock time of the complete simulation, without the measurements.\n\n" + speed_table(e);
  return text;
}

}  // namespace esim::inline evaluate
