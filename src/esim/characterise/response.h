#pragma once

#include <functional>
#include <span>
#include <vector>

#include "esim/characterise/trials.h"

namespace esim::inline characterise {

/// Time constants of the two poles before a pixel's comparators (docs/methods/circuit.md): of the photodiode, t1 =
/// t1_lux_s / (lux + dark_lux), inversely proportional to the photocurrent, and of the source follower, t2.
struct ResponseTimes {
  double t1_lux_s = 0, t2_s = 0;
  double dark_lux = 0;  ///< illuminance with the photocurrent of the dark current

  double t1_s(double lux) const { return t1_lux_s / (lux + dark_lux); }
  double sum_s(double lux) const { return t1_s(lux) + t2_s; }
  /// The contrast ln(I1 / I0) of photocurrents that the contrast of the light causes.
  double effective(double contrast, double lux) const;
  /// The frequency at which the gain is 1 / sqrt(2), for small sinusoids, Hz.
  double bandwidth_hz(double lux) const;
};

/// The gain |H| of two poles for small sinusoids: 1 / sqrt((1 + (2 pi f t1)^2) (1 + (2 pi f t2)^2)).
double gain(double frequency_hz, double t1_s, double t2_s);

/// Time from a step of the light at which the signal has changed by `threshold`; infinity if it never does. `contrast`
/// is that of the photocurrents, `t1_s` the time constant at the light after the step. The photodiode, y(t) = contrast
/// - ln(1 + (exp(contrast) - 1) exp(-t / t1)), is exact; the source follower is integrated numerically.
double step_latency_s(double contrast, double threshold, double t1_s, double t2_s);

/// The amplitude of a sinusoid to which half of the pixels respond, for each frequency.
struct AmplitudePoint {
  double frequency_hz = 0, amplitude = 0;  ///< ln
};

/// The contrast to which half of the trials have a response: the centre of a cumulative normal distribution, fitted by
/// maximum likelihood to the fractions, and its standard deviation. NaN if no fraction is between 0 and 1 and all are
/// equal.
struct CumulativeNormal {
  double centre = 0, deviation = 0;
};
CumulativeNormal fit_cumulative_normal(const TrialCounts& counts);

/// Measures with sinusoids how the amplitude that fires half of the pixels rises with the frequency, and finds the time
/// constants t1 >= t2 at `lux` that explain it: amplitude = threshold / gain, corrected for the photodiode's
/// second-order response (a rise is faster than a fall). `steps`: a protocol of steps at this light, whose sign of the
/// contrasts, reset and repeats are used. The signal's noise must be small compared with the threshold, and the
/// polarity must be that with the lower threshold. Throws UserError if no amplitude fires half of the pixels.
struct Bandwidth {
  std::vector<AmplitudePoint> points;
  double t1_s = 0, t2_s = 0;
  double threshold = 0;     ///< in the contrast of the light, ln: with dark current, larger than that of the signal
  double bandwidth_hz = 0;  ///< -3 dB
};
Bandwidth measure_bandwidth(const SensorUnderTest& sensor, const TrialProtocol& steps,
                            std::span<const double> frequencies_hz, double threshold_guess);

/// A latency at an illuminance.
struct LatencyPoint {
  double lux = 0;  ///< before the step
  double latency_s = 0;
};

/// The time constants that explain the latencies of steps with this contrast, by least squares of their logarithms.
/// `dark_lux` must be known. At least one of the latencies must be dominated by each time constant.
ResponseTimes fit_latencies(std::span<const LatencyPoint> points, double contrast, double threshold, double dark_lux);

}  // namespace esim::inline characterise
