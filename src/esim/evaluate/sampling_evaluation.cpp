#include "esim/evaluate/sampling_evaluation.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "esim/core/error.h"
#include "esim/evaluate/tapped_sampler.h"
#include "esim/scenario/sampling_text.h"
#include "esim/sim/stopwatch.h"

namespace esim::inline evaluate {
namespace {

/// Thrown if the monitor stops the evaluation.
struct Stopped {};

/// Keeps only events.
class EventStore final : public Sink {
 public:
  explicit EventStore(bool keep) : keep_(keep) {}

  void begin(const RecordingInfo&) override {}
  void end(bool) override {}
  void write(const Record& record) override {
    const auto* const part = std::get_if<EventsRecord>(&record);
    if (part != nullptr && keep_) events_.insert(events_.end(), part->events.begin(), part->events.end());
  }
  EventSpan events() const { return events_; }

 private:
  bool keep_;
  std::vector<Event> events_;
};

/// Only camera 0, ideal except for its thresholds, without frames and ground truth.
Scenario bare(const Scenario& scenario) {
  Scenario bare = scenario;
  bare.cameras.resize(1);
  const EventCameraOptions given = in_light_of(scenario, scenario.cameras.at(0).first_sensor());
  bare.cameras[0].event_cameras.clear();
  SensorOptions& sensor = bare.cameras[0].event_camera;
  sensor = {};
  sensor.contrast_threshold = given.contrast_threshold;
  sensor.contrast_threshold_on = given.threshold_on();
  sensor.contrast_threshold_off = given.threshold_off();
  sensor.log_eps = given.dark_light();
  bare.cameras[0].events = true;
  bare.cameras[0].frame_camera.reset();
  bare.truth.rate_hz = bare.truth.pose_rate_hz = 0;
  return bare;
}

/// The same scenario with another number of rays for pixels at edges.
Scenario with_rays(Scenario scenario, int samples_per_pixel) {
  auto* const mesh = std::get_if<MeshRendererOptions>(&scenario.renderer);
  if (mesh == nullptr) throw UserError("--truth-rays: the renderer casts no rays; omit this option");
  mesh->samples_per_pixel = samples_per_pixel;
  return scenario;
}

/// Computes the progress from the parts of the work.
class Share {
 public:
  Share(const EvaluationMonitor& monitor, std::size_t schemes)
      : monitor_(monitor), parts_(static_cast<double>(schemes) + 2) {}

  void start(std::string what, double parts) {
    done_ += length_;
    what_ = std::move(what);
    length_ = parts / parts_;
  }
  /// Reports the completed fraction of the current part.
  void show(double fraction) const {
    if (!monitor_.progress(done_ + fraction * length_, what_)) throw Stopped();
  }

 private:
  const EvaluationMonitor& monitor_;
  double parts_, done_ = 0, length_ = 0;
  std::string what_;
};

class Evaluation {
 public:
  Evaluation(const Scenario& scenario, const SamplingEvaluationOptions& options, const Notices& notices,
             const EvaluationMonitor& monitor)
      : scenario_(bare(scenario)),
        notices_(notices),
        monitor_(monitor),
        share_(monitor, options.schemes.size()),
        world_(build_world(scenario_, options.threads, notices)) {
    result_.options = options;
    const Camera& model = world_.info.cameras[0].model;
    result_.width = model.width, result_.height = model.height;
    result_.renderer = world_.cameras[0].renderer->traits().label();
    result_.threads = world_.workers->threads();
    result_.span = {world_.info.start, world_.info.end};
    const EventCameraOptions& sensor = scenario_.cameras[0].event_camera;
    result_.contrast_threshold = sensor.min_threshold();
    result_.log_eps = sensor.dark_light();
    result_.pixels = spread_pixels(model.width, model.height, options.pixels);
  }

  SamplingEvaluation run() {
    {
      Stopwatch stopwatch(result_.wall_seconds);
      choose_spans();
      render_truth();
      simulate_reference_events();
      for (const SamplingOptions& scheme : result_.options.schemes) measure(scheme);
      result_.goals = interpolate_goals(result_.schemes, result_.options.rmse_goal);
    }
    return std::move(result_);
  }

 private:
  const SamplingEvaluationOptions& options() const { return result_.options; }

  void choose_spans() {
    share_.start("motion field", 0);
    share_.show(0);
    const auto pixels = spread_pixels(result_.width, result_.height, 400);
    result_.motion = measure_motion(world_, pixels, options().motion_rate_hz);
    result_.windows = choose_windows(result_.motion, result_.span, options().window_s);
    if (options().event_span_s <= 0) return;
    for (const Window& window : result_.windows)
      result_.event_spans.push_back(typical_part(result_.motion, window, options().event_span_s));
  }

  void render_truth() {
    if (options().truth_rays > 0)
      truth_world_ = build_world(with_rays(scenario_, options().truth_rays), options().threads, silent_);
    reference_ =
        std::make_unique<ReferenceBrightness>(truth_world_ ? *truth_world_ : world_, result_.pixels,
                                              options().truth_rate_hz, result_.log_eps, options().memory_bytes);
    share_.start("true brightness", 0.5);
    if (!reference_->fits()) return;  // rendered block by block for each scheme
    Stopwatch stopwatch(result_.truth_seconds);
    for (std::int64_t i = 0; i < reference_->blocks(); ++i) {
      share_.show(static_cast<double>(i) / static_cast<double>(reference_->blocks()));
      reference_->block(i);
    }
  }

  void simulate_reference_events() {
    share_.start("reference events", 1.5);
    for (std::size_t i = 0; i < result_.event_spans.size(); ++i) {
      const double all = static_cast<double>(result_.event_spans.size());
      const Summary summary =
          simulate_span(UniformSampling{options().event_rate_hz}, result_.event_spans[i],
                        [&](double fraction) { share_.show((static_cast<double>(i) + fraction) / all); });
      result_.event_reference_seconds += summary.wall_seconds;
      result_.reference_events.push_back(static_cast<std::int64_t>(reference_events_.back().events()));
    }
  }

  /// Simulates a part of the time from an initial state, and appends the events to reference_events_.
  Summary simulate_span(const SamplingOptions& scheme, const TimeSpan& span,
                        const std::function<void(double fraction)>& show) {
    EventStore events(true);
    World world = build_world(part(scheme, span), options().threads, silent_);
    const Summary summary = simulate(world, events, [&](const Progress& progress) {
      show(static_cast<double>(progress.now - progress.start) / static_cast<double>(progress.end - progress.start));
      return true;
    });
    if (!summary.problem.empty()) throw UserError(summary.problem);
    reference_events_.emplace_back(events.events(), result_.width, result_.height);
    return summary;
  }

  Scenario part(const SamplingOptions& scheme, const TimeSpan& span) const {
    Scenario scenario = scenario_;
    scenario.cameras[0].sampling = scheme;
    scenario.start_s += to_seconds(span.start - result_.span.start);
    scenario.duration_s = to_seconds(span.end - span.start);
    return scenario;
  }

  void measure(const SamplingOptions& scheme) {
    SchemeResult result;
    result.options = scheme;
    result.text = sampling_text(scheme);
    result.family = sampling_family(scheme);
    share_.start(result.text, 1);
    simulate_whole(result);
    for (std::size_t i = 0; i < result_.event_spans.size(); ++i) {
      simulate_span(scheme, result_.event_spans[i], [&](double) { share_.show(1); });
      result.windows[i].events = compare_events(reference_events_[i], reference_events_.back());
      reference_events_.pop_back();
    }
    result_.schemes.push_back(std::move(result));
    monitor_.scheme_done(result_);
  }

  /// Simulates the whole time, and measures the segments that the event camera receives.
  void simulate_whole(SchemeResult& result) {
    for (const Window& window : result_.windows)
      result.windows.push_back({to_seconds(window.span.end - window.span.start), 0, 0, {}, {}});
    BrightnessErrors errors(*reference_, result_.width, result_.height, result_.windows, result_.contrast_threshold);
    const double pixels = static_cast<double>(result_.width) * result_.height;
    double measuring_s = 0;
    const auto listen = [&](const Tapped& tapped) {
      Stopwatch stopwatch(measuring_s);
      for (std::size_t i = 0; i < result_.windows.size(); ++i) {
        const TimeSpan& span = result_.windows[i].span;
        if (tapped.t <= span.start || tapped.t > span.end) continue;
        result.windows[i].samples_per_s += static_cast<double>(tapped.samples) / result.windows[i].duration_s;
        result.windows[i].frame_equivalents_per_s +=
            static_cast<double>(tapped.pixel_evaluations) / pixels / result.windows[i].duration_s;
      }
      errors.add(tapped.segments);
    };

    World world = build_world(part(result.options, result_.span), options().threads, silent_);
    CameraChannel& camera = world.cameras[0];
    camera.sampler = std::make_unique<TappedSampler>(std::move(camera.sampler), listen);
    EventStore events(false);
    const double all_s = to_seconds(result_.span.end - result_.span.start);
    const Summary summary = simulate(world, events, [&](const Progress& progress) {
      share_.show(to_seconds(progress.now - progress.start) / all_s);
      return true;
    });
    if (!summary.problem.empty()) throw UserError(summary.problem);

    std::vector<BrightnessError> brightness = errors.finish();
    for (std::size_t i = 0; i < brightness.size(); ++i) result.windows[i].brightness = std::move(brightness[i]);
    const CameraSummary& done = summary.cameras[0];
    result.held_to_max_rate = done.sampling.held_to_max_rate;
    result.events = done.events();
    result.seconds = summary.seconds;
    result.seconds.sampling = std::max(0.0, result.seconds.sampling - measuring_s);
    result.wall_seconds = summary.wall_seconds - measuring_s;
    result.real_time_factor = all_s / result.wall_seconds;
  }

  Scenario scenario_;
  const Notices& notices_;
  const EvaluationMonitor& monitor_;
  Share share_;
  World world_;
  std::optional<World> truth_world_;  // if options().truth_rays is set
  SamplingEvaluation result_;
  std::unique_ptr<ReferenceBrightness> reference_;
  std::vector<EventsByPixel> reference_events_;                                 // of each of event_spans
  const Notices silent_{[](const std::string&) {}, [](const std::string&) {}};  // the first world reported all
};

}  // namespace

std::vector<GoalCost> interpolate_goals(const std::vector<SchemeResult>& schemes, double rmse_goal) {
  struct Point {
    double rmse, frames, samples;
  };
  std::vector<std::string> families;
  for (const SchemeResult& scheme : schemes) {
    if (std::find(families.begin(), families.end(), scheme.family) == families.end()) families.push_back(scheme.family);
  }
  std::vector<GoalCost> goals;
  for (const std::string& family : families) {
    std::vector<Point> curve;
    for (const SchemeResult& scheme : schemes) {
      const WindowResult& all = scheme.windows.back();
      if (scheme.family == family && all.brightness.mean_rmse > 0)
        curve.push_back({all.brightness.mean_rmse, all.frame_equivalents_per_s, all.samples_per_s});
    }
    std::sort(curve.begin(), curve.end(), [](const Point& a, const Point& b) { return a.frames < b.frames; });
    GoalCost goal{family, {}, {}};
    for (std::size_t i = 0; i + 1 < curve.size() && !goal.samples_per_s; ++i) {
      const Point &a = curve[i], &b = curve[i + 1];
      if (!(a.rmse > rmse_goal && b.rmse <= rmse_goal)) continue;
      const double share = std::log(rmse_goal / a.rmse) / std::log(b.rmse / a.rmse);
      goal.frame_equivalents_per_s = a.frames * std::pow(b.frames / a.frames, share);
      goal.samples_per_s = a.samples * std::pow(b.samples / a.samples, share);
    }
    goals.push_back(std::move(goal));
  }
  return goals;
}

std::optional<SamplingEvaluation> evaluate_sampling(const Scenario& scenario, const SamplingEvaluationOptions& options,
                                                    const Notices& notices, const EvaluationMonitor& monitor) {
  try {
    return Evaluation(scenario, options, notices, monitor).run();
  } catch (const Stopped&) {
    return std::nullopt;
  }
}

}  // namespace esim::inline evaluate
