#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "esim/compare/event_matching.h"
#include "esim/compose/compose.h"
#include "esim/evaluate/brightness_errors.h"
#include "esim/evaluate/windows.h"

namespace esim::inline evaluate {

struct SamplingEvaluationOptions {
  std::vector<SamplingOptions> schemes;
  int pixels = 400;               ///< number of pixels at which brightness is compared; 0: all
  double truth_rate_hz = 10000;   ///< rate of the true brightness
  int truth_rays = 0;             ///< samples_per_pixel of the true brightness; 0: the scenario's
  double motion_rate_hz = 200;    ///< rate at which the motion field is measured
  double window_s = 1;            ///< length of the slow window and of the fast one
  double event_span_s = 0.05;     ///< time in each window for which events are compared; 0: no events
  double event_rate_hz = 100000;  ///< rate of the uniform sampling that generates the reference events
  double rmse_goal = 0.01;        ///< RMSE at which the cost is interpolated
  std::size_t memory_bytes = std::size_t{1} << 29;  ///< memory for the true brightness
  int threads = 0;
};

/// The results of a scheme in one window.
struct WindowResult {
  double duration_s = 0;
  double samples_per_s = 0;            ///< requests to the renderer
  double frame_equivalents_per_s = 0;  ///< pixel evaluations / (W H)
  BrightnessError brightness;
  std::optional<EventComparison> events;  ///< in the window's typical part
};

struct SchemeResult {
  SamplingOptions options;
  std::string text;    ///< sampling_text(options)
  std::string family;  ///< sampling_family(options)
  std::vector<WindowResult> windows;
  std::int64_t held_to_max_rate = 0;
  std::int64_t events = 0;  ///< of the whole run
  StageSeconds seconds;     ///< of the whole run, without the measurements
  double wall_seconds = 0;  ///< likewise
  double real_time_factor = 0;
};

/// The cost at which a family of schemes reaches the goal: where its curve of RMSE against cost, linear in logarithms
/// between its schemes, first falls below the goal.
struct GoalCost {
  std::string family;
  std::optional<double> frame_equivalents_per_s, samples_per_s;  ///< not set if the curve does not cross the goal
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
  std::vector<TimeSpan> event_spans;           ///< of each window; empty if no events are compared
  std::vector<std::int64_t> reference_events;  ///< in each of event_spans
  std::vector<SchemeResult> schemes;
  std::vector<GoalCost> goals;                            ///< in the window "all"
  double truth_seconds = 0, event_reference_seconds = 0;  ///< wall-clock time for the references
  double wall_seconds = 0;
};

/// Callbacks that follow an evaluation.
struct EvaluationMonitor {
  /// Receives the completed fraction and the current step; returns false to stop.
  std::function<bool(double fraction, const std::string& what)> progress;
  /// Called after each scheme.
  std::function<void(const SamplingEvaluation& so_far)> scheme_done;
};

/// Simulates camera 0 of a scenario with each sampling scheme and measures errors and cost; docs/methods/sampling.md
/// defines the measures. The event camera is ideal except for the scenario's thresholds. Returns nothing if the monitor
/// stopped the evaluation. Throws UserError for problems that the user can repair.
std::optional<SamplingEvaluation> evaluate_sampling(const Scenario& scenario, const SamplingEvaluationOptions& options,
                                                    const Notices& notices, const EvaluationMonitor& monitor);

/// Computes the GoalCost of each family from the last window.
std::vector<GoalCost> interpolate_goals(const std::vector<SchemeResult>& schemes, double rmse_goal);

}  // namespace esim::inline evaluate
