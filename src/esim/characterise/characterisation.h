#pragma once

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "esim/characterise/rates.h"
#include "esim/event_camera/options.h"

namespace esim::inline characterise {

struct CharacterisationOptions {
  std::vector<double> lux{0.1, 1, 10, 100, 1000};  ///< illuminances of the sensor
  int width = 24, height = 24;                     ///< pixels on the bench
  int repeats = 10;                                ///< trials of each contrast
  double noise_s = 10;                             ///< recording in constant light
  int sensor_width = 346, sensor_height = 260;     ///< pixels of the peak rate
  std::uint64_t seed = 0;
  int threads = 1;  ///< that measure at the same time, as in Workers; the result does not depend on it
};

/// Responses of pixels to changes of the light by contrast.
struct SCurve {
  std::vector<double> contrasts, fractions;                    ///< ln, negative for OFF; of all trials
  double threshold = std::numeric_limits<double>::quiet_NaN(); /**< contrast at which half of the trials respond, ln,
                                                                    above 0 */
  double width = std::numeric_limits<double>::quiet_NaN();     ///< standard deviation of the fitted normal distribution
  /// Standard deviation of the pixels' own thresholds, without that of the trials: the non-uniformity, ln.
  double non_uniformity = std::numeric_limits<double>::quiet_NaN();
};

/// A sensor at one illuminance. What could not be measured is NaN, and `notes` say why.
struct LightLevel {
  double lux = 0;
  SCurve on, off;                                              ///< steps
  SCurve on_ramp;                                              ///< ramps that last ten response times
  double latency_s = std::numeric_limits<double>::quiet_NaN(); /**< median from a step that doubles the light to the ON
                                                                    event */
  double jitter_s = std::numeric_limits<double>::quiet_NaN();  ///< half of the central 68 % of these times
  double bandwidth_hz = std::numeric_limits<double>::quiet_NaN();  ///< -3 dB, for small sinusoids
  double noise_on_hz = 0, noise_off_hz = 0;                        ///< of a pixel in constant light
  double alternating = 0;                                          ///< consecutive events of opposite polarity
  std::vector<std::string> notes;
};

struct Characterisation {
  std::string name;
  bool in_lux = true;  ///< otherwise, `lux` is relative irradiance: the sensor has no circuit
  std::vector<LightLevel> levels;
  /// Illuminance at which half of the pixels respond to a step that doubles the light.
  double cutoff_lux = std::numeric_limits<double>::quiet_NaN();
  double refractory_s = std::numeric_limits<double>::quiet_NaN();
  double peak_rate_hz = 0;  ///< of the whole sensor, in the busiest ms of a flicker at 100 Hz between 316 and 3160 lux
  std::vector<std::string> notes;

  /// From the cutoff to 100,000 lux (direct sunlight), dB: 20 log10 of the ratio.
  double dynamic_range_db() const;
};

/// Measures a simulated sensor as makers of sensors do (docs/methods/bench.md). For each S-curve and latency, the
/// refractory period is set to ten response times, as the method needs; everything else is as given. `progress` gets
/// the finished part, 0 to 1, from one thread at a time. Throws UserError if options are invalid.
Characterisation characterise_sensor(const std::string& name, const EventCameraOptions& sensor,
                                     const CharacterisationOptions& options,
                                     const std::function<void(double)>& progress = {});

/// One or two sensors as a table, and as JSON in SI units with null for what is not known.
std::string describe(const std::vector<Characterisation>& sensors);
std::string to_json(const std::vector<Characterisation>& sensors);

}  // namespace esim::inline characterise
