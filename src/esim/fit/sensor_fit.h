#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "esim/core/image.h"
#include "esim/event_camera/options.h"
#include "esim/fit/circuit/pixel_counts.h"
#include "esim/fit/estimate.h"
#include "esim/plot/colour.h"
#include "esim/recording/format.h"

namespace esim::inline fit {

/// A recording of light that fills the view.
struct LitRecording {
  std::filesystem::path path;
  KnownLight light{};
};

/// Recordings of one sensor, in any format that can be read.
struct FitInput {
  std::vector<std::filesystem::path> moving;  ///< a moving scene: events, and images of the same view
  std::vector<LitRecording> constant;         ///< a scene without motion, in constant light, whose lux may be unknown
  std::vector<LitRecording> flicker;          ///< a flickering lamp
  std::vector<std::filesystem::path> other;   ///< any other events
  std::optional<SensorSize> sensor{};         ///< replaces the size in the files
};

struct FitOptions {
  std::string base = "ideal";  ///< preset whose values stay where the recordings determine none
  bool find_offset = false;    ///< whether to find the offset of the logarithm, too
  /// Gets the part of the work that is done, 0 to 1, and what is next; false ends it.
  std::function<bool(double, const std::string&)> progress{};
};

/// A recording that was used.
struct FittedRecording {
  std::string path, use;  ///< "moving", "static", "flicker", "other"
  std::uint64_t events = 0, images = 0;
  double duration_s = 0;
};

/// A sensor, as far as recordings determine it.
struct SensorFit {
  std::string base;
  SensorSize sensor{};
  std::vector<FittedRecording> recordings;
  std::vector<Estimate> estimates;     ///< one for each parameter, determined or not
  std::vector<Estimate> observations;  ///< that are no parameters, such as the delay of the events
  std::vector<std::string> notes;
  std::vector<FittedDistribution> distributions;
};

/// Fits a sensor to recordings (docs/methods/fitting.md). What they do not determine says why. Throws UserError if
/// a file cannot be read, if sizes of sensors differ or are unknown, or without any recording. Nothing if `progress`
/// ended it.
std::optional<SensorFit> fit_sensor(const FitInput& input, const FitOptions& options);

/// An `event_camera` for scenarios, with intervals as comments.
std::string to_yaml(const SensorFit& fit);
/// Tables.
std::string describe(const SensorFit& fit);
/// A report in Markdown; `figure`: the name of the file of draw_fit(), or empty.
std::string to_markdown(const SensorFit& fit, const std::string& figure);
std::string to_json(const SensorFit& fit);
/// Measured and fitted distributions side by side.
Image<Rgb> draw_fit(const SensorFit& fit);

}  // namespace esim::inline fit
