#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "esim/characterise/bench.h"

namespace esim::inline characterise {

/// A series of trials, in each of which the light changes by a known amount and pixels respond or not.
///
/// Each trial begins with a pulse of brighter light, at which all pixels fire. Their refractory period must last until
/// the response to the pulse has decayed: then the reference of a pixel is its signal in steady light, noise included,
/// and the trial begins from a known state. Set the sensor's refractory period accordingly. After `settle_s`, the light
/// changes, and returns after `window_s`.
struct TrialProtocol {
  double lux = 0;                 ///< steady illuminance
  std::vector<double> contrasts;  ///< changes of ln(lux), all of one sign: positive for ON, negative for OFF
  int repeats = 1;                ///< trials with each contrast
  double frequency_hz = 0;        ///< 0: a step; otherwise a sinusoid with the contrast as amplitude

  double pulse_contrast = 3, pulse_s = 0;  ///< ln
  double settle_s = 0;                     ///< longer than the refractory period
  double change_s = 1e-6;                  ///< how long a step takes: longer for a ramp; part of the window
  double window_s = 0;                     ///< of a step; that of a sinusoid is kSinePeriods periods

  /// A sinusoid swells during its first periods, so that its onset causes no response.
  static constexpr int kSinePeriods = 7, kSwellingPeriods = 4;
  double response_s() const { return frequency_hz > 0 ? kSinePeriods / frequency_hz : window_s; }

  /// A protocol of steps for pixels with this response time (the sum of their time constants) and refractory period.
  static TrialProtocol steps(double lux, std::vector<double> contrasts, int repeats, double response_time_s,
                             double refractory_s);
};

/// How often each pixel responded to each contrast: fired and trials of pixel i and contrast k at
/// [i contrasts.size() + k].
struct TrialCounts {
  TrialProtocol protocol;
  std::size_t pixels = 0;
  std::vector<std::uint32_t> fired, trials;
  std::vector<std::vector<double>> latencies_s;  ///< for each contrast: from the change to a pixel's first event

  double fraction(std::size_t contrast) const;          ///< of all trials of a contrast; NaN without trials
  double median_latency_s(std::size_t contrast) const;  ///< infinity if fewer than half of the trials have a response
};

/// The light of all trials.
std::vector<LightPoint> light_of(const TrialProtocol& protocol);

/// Counts the responses in the events of light_of(protocol): events of the polarity of the contrasts. A pixel's trial
/// does not count if the pixel did not fire at the pulse, fired between its reset and the change, or first fired with
/// the other polarity. Throws UserError if no trial counts.
TrialCounts count_responses(const TrialProtocol& protocol, const std::vector<Event>& events, int width, int height);

/// Both: shows the light and counts the responses.
TrialCounts measure(const SensorUnderTest& sensor, const TrialProtocol& protocol);

}  // namespace esim::inline characterise
