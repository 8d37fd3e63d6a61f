#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "esim/compare/likeness.h"
#include "esim/event_camera/options.h"
#include "esim/fit/simulated/simulation_fit.h"
#include "esim/stats/sensor/frame_times.h"

namespace esim::inline evaluate {

/// A model of a sensor to compare with real recordings: an event camera, or another program.
struct SensorModel {
  std::string name;
  EventCameraOptions options{};
  /// If not empty, a command of the shell that makes the events: {frames} is a folder with 16-bit images of linear
  /// intensity and images.csv (time in ns, file name), {events} the file to write: lines t x y p, or any other format.
  std::string command{};
};

/// A part of a clip, in fractions of its duration: from its start, or to its end.
struct ClipPart {
  std::string clip;
  double from = 0, to = 0.5;
};

struct RealismOptions {
  std::uint64_t seed = 1;
  int threads = 1;
  double frame_step_s = 2.5e-4;  ///< of the frames that move
  /// Motion before the clip, which does not count: areas whose contrast is below the thresholds have then had their
  /// events. Its frames are history_step_s apart, until before_s before the clip.
  double history_s = 2, history_step_s = 8e-3, before_s = 0.03;
  /// If set, each event camera is also fitted to this part, by simulation, and compared. Of that clip, only the rest is
  /// then compared.
  std::optional<ClipPart> fit_to{};
};

/// A model against a clip of a real sensor.
struct ClipResult {
  std::string clip, model;
  std::vector<ComparedStatistic> statistics;  ///< first: real; second: the model's
  double seconds = 0;                         ///< that the model took

  /// The sum over all statistics of the distance in standard deviations, at most kCap each.
  static constexpr double kCap = 20;
  double sum_of_deviations() const;
};

/// A model against a recording of real noise: Kolmogorov-Smirnov distances, NaN without events.
struct NoiseResult {
  std::string recording, model;
  double lux = 0;
  double real_on = 0, real_off = 0, on = 0, off = 0;  ///< mean events of a pixel
  double ks_counts_on = 0, ks_counts_off = 0, ks_intervals_on = 0, ks_intervals_off = 0;
};

/// An event camera that was fitted to a part of a clip.
struct FittedModel {
  std::string model;  ///< the one it was made from; results name it model + kFitted
  SimulationFit fit;
};
inline constexpr const char* kFitted = ", fitted";

/// When the chip of a clip took frames, found by the events that they cause.
struct ClipFrames {
  std::string clip;
  FrameTimes frames;
};

struct RealismEvaluation {
  std::vector<ClipFrames> frames;
  std::vector<FittedModel> fitted;
  std::vector<ClipResult> clips;
  std::vector<NoiseResult> noise;
};

/// Compares models with the real recordings in a folder (docs/methods/realism.md). If the chip of a clip took frames,
/// those of the event cameras have the same times. Other programs are compared with
/// clips only. `progress` gets the finished part, 0 to 1, and what is next; false ends the evaluation, which then
/// returns what is finished. Throws UserError if the folder contains no recordings, or if a command fails.
RealismEvaluation evaluate_realism(const std::filesystem::path& folder, const std::vector<SensorModel>& models,
                                   const RealismOptions& options,
                                   const std::function<bool(double, const std::string&)>& progress);

/// Tables, and JSON in SI units with null for what is not defined.
std::string describe(const RealismEvaluation& evaluation);
std::string to_json(const RealismEvaluation& evaluation);

}  // namespace esim::inline evaluate
