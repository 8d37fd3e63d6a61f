#pragma once

#include <span>

#include "esim/characterise/response.h"
#include "esim/characterise/trials.h"

namespace esim::inline characterise {

/// What S-curves tell about the pixels of a sensor, for one polarity.
struct PixelEstimate {
  double threshold = 0;  ///< mean of the pixels, ln
  double mismatch = 0;   ///< standard deviation of the threshold from pixel to pixel, ln
  double charge_e = 0;   ///< charge per e-fold of the photoreceptor, in elementary charges: sets the noise
  ResponseTimes times;   ///< as given, with the dark current that was found

  /// Standard deviation of the signal's noise in steady light, ln: sqrt(q / (Q + I t2)) = sqrt(t1 / (Q/q (t1 + t2))).
  double noise(double lux) const;
  /// Photocurrent per illuminance, and dark current: I = Q / t1.
  double photocurrent_fa_per_lux() const;
  double dark_current_fa() const { return photocurrent_fa_per_lux() * times.dark_lux; }
};

struct FitOptions {
  /// Whether the dark current is to be found: needs recordings at two illuminances, of which one is at most as large as
  /// that of the dark current.
  bool dark_current = false;
};

/// The probability that a pixel responds to a step of light within the protocol's window, if its threshold is
/// `threshold` and its noise that of `estimate`; mismatch does not matter. The reference contains a value n0 of the
/// noise, of the time of its reset. The pixel responds if signal + noise rise from there by the threshold at any time:
/// the level is u(t) = threshold + n0 - contrast g(t), with the step response g of the two poles. With the noise's
/// standard deviation s, that of its derivative s' = s / sqrt(t1 t2), z = u / s and m = -u' / s', it rises above the
/// level at the rate (Rice)
///
///   r(t) = c(z) (s'/s) phi(z) (phi(m) + m Phi(m)),   P = 1 - E over n0 of exp(-integral of r / Phi(z) dt)
///
/// c = 1 / (1 + 0.165 (1 - exp(-4 w)) / w^2) with w = max(z, 2.2) sqrt(t1 t2) / (t1 + t2), 0.7 to 1, accounts for
/// crossings in clusters, and tends to 1 as m tends to 1.
double response_probability(const TrialProtocol& steps, double contrast, double threshold,
                            const PixelEstimate& estimate);

/// Fits threshold, mismatch and charge (and dark current) to S-curves by maximum likelihood. A pixel's threshold is the
/// same in all trials, so that mismatch and noise are distinguished by repeated trials of each pixel. The recordings
/// must be of steps in the same direction, each with its own illuminance. `times`: measured with measure_bandwidth() or
/// fit_latencies(). Throws UserError if no contrast has responses in part of its trials.
PixelEstimate fit_steps(std::span<const TrialCounts> recordings, const ResponseTimes& times,
                        const FitOptions& options = {});

}  // namespace esim::inline characterise
