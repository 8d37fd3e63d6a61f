#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "esim/compose/compose.h"
#include "esim/evaluate/brightness_errors.h"
#include "esim/evaluate/event_comparison.h"
#include "esim/evaluate/windows.h"

namespace esim {

struct SamplingEvaluationOptions {
  std::vector<SamplingOptions> schemes;
  int pixels = 400;                                 ///< at which brightness is compared; 0: all
  double truth_rate_hz = 10000;                     ///< of the brightness to compare with
  int truth_rays = 0;                               ///< samples_per_pixel of that; 0: the scenario's
  double motion_rate_hz = 200;                      ///< at which the motion field is measured
  double window_s = 1;                              ///< length of the slow and the fast window
  double event_span_s = 0.05;                       ///< of which events are compared, in each window; 0: no events
  double event_rate_hz = 100000;                    ///< of the uniform sampling to compare events with
  double rmse_goal = 0.01;                          ///< for which the cost is interpolated
  std::size_t memory_bytes = std::size_t{1} << 29;  ///< for the true brightness
  int threads = 0;
};

/// What a scheme did in one window.
struct WindowResult {
  double duration_s = 0;
  double samples_per_s = 0;            ///< requests to the renderer
  double frame_equivalents_per_s = 0;  ///< pixel evaluations / (W H)
  BrightnessError brightness;
  std::optional<EventComparison> events;  ///< of the window's typical part
};

struct SchemeResult {
  SamplingOptions options;
  std::string text;    ///< sampling_text(options)
  std::string family;  ///< sampling_family(options)
  std::vector<WindowResult> windows;
  std::int64_t held_to_max_rate = 0;
  std::int64_t events = 0;  ///< of the whole run
  StageSeconds seconds;     ///< of the whole run, without what measuring took
  double wall_seconds = 0;  ///< likewise
  double real_time_factor = 0;
};

/// What a family of schemes costs where its error is the goal: where its curve of RMSE over cost, straight between its
/// schemes in logarithms, first falls below it.
struct GoalCost {
  std::string family;
  std::optional<double> frame_equivalents_per_s, samples_per_s;  ///< not set where the curve does not cross the goal
};

struct SamplingEvaluation {
  SamplingEvaluationOptions options;
  std::string renderer;
  int width = 0, height = 0, threads = 0;
  TimeSpan span;
  double contrast_threshold = 0, log_eps = 0;
  std::vector<PixelPosition> pixels;
  MotionCurve motion;
  std::vector<Window> windows;
  std::vector<TimeSpan> event_spans;           ///< of each window; empty where no events are compared
  std::vector<std::int64_t> reference_events;  ///< in each of them
  std::vector<SchemeResult> schemes;
  std::vector<GoalCost> goals;                            ///< in the window "all"
  double truth_seconds = 0, event_reference_seconds = 0;  ///< that the references took
  double wall_seconds = 0;
};

/// Who hears how an evaluation goes.
struct EvaluationMonitor {
  /// How much is done, and what is being done; returns false to stop.
  std::function<bool(double fraction, const std::string& what)> progress;
  /// After each scheme.
  std::function<void(const SamplingEvaluation& so_far)> scheme_done;
};

/// Simulates camera 0 of a scenario with each way of sampling, the event camera being ideal but for the scenario's
/// thresholds, and measures what each sees and what it costs. docs/methods/sampling.md defines the measures. Nothing is
/// returned where the monitor stopped it. Throws UserError for what the user can repair.
std::optional<SamplingEvaluation> evaluate_sampling(const Scenario& scenario, const SamplingEvaluationOptions& options,
                                                    const Notices& notices, const EvaluationMonitor& monitor);

/// Fills in a GoalCost for each family, from the last window.
std::vector<GoalCost> interpolate_goals(const std::vector<SchemeResult>& schemes, double rmse_goal);

}  // namespace esim
