#pragma once

#include <span>
#include <vector>

#include "esim/characterise/bench.h"

namespace esim::inline characterise {

/// Events of all pixels in constant light.
struct NoiseRates {
  double lux = 0;
  double on_hz = 0, off_hz = 0;  ///< mean of a pixel
  double alternating = 0;        ///< fraction of consecutive events of a pixel with different polarities; NaN without
  std::vector<double> pixels_on_hz, pixels_off_hz;  ///< by row

  /// Rate of the leak as the ON events that it alone would cause. A pixel's reference stays near its signal, so that
  /// leak = on_hz - off_hz C- / C+.
  double leak_hz(double threshold_ratio = 1) const { return on_hz - threshold_ratio * off_hz; }
};

/// Counts the events of `duration_s` in constant light, after `settle_s` in the same light.
NoiseRates measure_noise(const SensorUnderTest& sensor, double lux, double settle_s, double duration_s);

/// The refractory period, from the intervals between events while the logarithm of the light rises linearly. A pixel
/// that follows the light fires at intervals of refractory period + threshold / rate: a line over 1 / rate.
struct Refractory {
  double period_s = 0;
  double threshold = 0;  ///< ln; of ON events
};

/// Light rises from `lux` by `contrast` (ln) at each of the rates (1/s, at least two). The response time of the pixel
/// must be short compared with contrast / rate; the first half of each rise does not count. The result is the mean over
/// the pixels. Throws UserError if there are too few events.
Refractory measure_refractory(const SensorUnderTest& sensor, double lux, double contrast, std::span<const double> rates,
                              double settle_s);

}  // namespace esim::inline characterise
