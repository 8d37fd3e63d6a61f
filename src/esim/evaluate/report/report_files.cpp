#include "esim/evaluate/report/report_files.h"

#include <fmt/format.h>

#include "esim/evaluate/report/figures.h"
#include "esim/evaluate/report/report_markdown.h"
#include "esim/files/output_file.h"
#include "esim/preview/pictures.h"

namespace esim::inline evaluate {
namespace {

/// One line per scheme and window.
std::string summary_csv(const SamplingEvaluation& evaluation) {
  std::string text =
      "scheme,window,frame_equivalents_per_s,samples_per_s,rmse_mean,error_mean_abs,error_p99_abs,error_max_abs,"
      "steps,steps_above_threshold,reference_events,events,matched,missing,spurious,active_pixels,identical_pixels,"
      "timing_median_s,timing_p95_s,wall_s,real_time_factor\n";
  for (const SchemeResult& scheme : evaluation.schemes) {
    for (std::size_t i = 0; i < scheme.windows.size(); ++i) {
      const WindowResult& window = scheme.windows[i];
      const BrightnessError& b = window.brightness;
      const EventComparison e = window.events.value_or(EventComparison{});
      text += fmt::format(
          "{},{},{:.3f},{:.3f},{:.6g},{:.6g},{:.6g},{:.6g},{},{},{},{},{},{},{},{},{},{:.4g},{:.4g},{:.4g},{:.4g}\n",
          scheme.text, evaluation.windows[i].name, window.frame_equivalents_per_s, window.samples_per_s, b.mean_rmse,
          b.mean_abs, b.p99_abs, b.max_abs, b.steps, b.large_steps, e.reference, e.events, e.matched, e.missing,
          e.spurious, e.active_pixels, e.identical_pixels, e.median_s, e.p95_s, scheme.wall_seconds,
          scheme.real_time_factor);
    }
  }
  return text;
}

/// One line per pixel of each scheme and window.
std::string samples_csv(const SamplingEvaluation& evaluation) {
  std::string text = "scheme,window,x,y,rmse\n";
  for (const SchemeResult& scheme : evaluation.schemes) {
    for (std::size_t i = 0; i < scheme.windows.size(); ++i) {
      const std::vector<double>& rmse = scheme.windows[i].brightness.rmse;
      for (std::size_t k = 0; k < rmse.size(); ++k) {
        text += fmt::format("{},{},{},{},{:.6g}\n", scheme.text, evaluation.windows[i].name, evaluation.pixels[k].x,
                            evaluation.pixels[k].y, rmse[k]);
      }
    }
  }
  return text;
}

}  // namespace

void write_report_files(const SamplingEvaluation& evaluation, const std::filesystem::path& folder) {
  write_file_atomically(folder / "report.md", to_markdown(evaluation));
  write_file_atomically(folder / "motion.png", encode_png(draw_motion(evaluation)));
  write_file_atomically(folder / "rmse.png", encode_png(draw_error_boxes(evaluation)));
  write_file_atomically(folder / "rmse_over_cost.png", encode_png(draw_error_over_cost(evaluation)));
  if (!evaluation.event_spans.empty())
    write_file_atomically(folder / "timing.png", encode_png(draw_timing(evaluation)));
  write_file_atomically(folder / "summary.csv", summary_csv(evaluation));
  write_file_atomically(folder / "samples.csv", samples_csv(evaluation));
}

}  // namespace esim::inline evaluate
