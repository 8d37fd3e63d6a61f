#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "esim/core/time.h"

namespace esim::inline stats {

enum class Banding {
  none,
  weak,    ///< significant, but less than 10 % of rms modulation
  strong,  ///< events prefer some phases of the period
  unknown  ///< fewer than 100 events or 20 periods
};

/// Distribution of time stamps in a period of 1 / frequency_hz, which reveals simulators that work frame by frame.
///
/// N time stamps t are counted in 64 bins n_b of their phase, the fractional part of t f, with E = N / 64:
///
///   chi2 = sum over b of (n_b - E)^2 / E,   63 degrees of freedom
///
/// Events come in bursts and rates change, so that chi2 is large at any frequency. It is therefore compared with c, the
/// median of chi2 / 63 at 32 frequencies f (1 +- 0.1 ... 0.3), but at least 1, the value of a Poisson process:
///
///   p_value    = Q(63 / 2, chi2 / (2 c))            (quasi-likelihood)
///   modulation = sqrt(max(0, chi2 - 63 c) / N)      rms of the rate over the period, relative to its mean
///
/// The time stamps show banding if p_value < 1e-4; it is strong if the modulation is at least 10 %. Time stamps in
/// whole microseconds are first spread over their microsecond, so that the bins do not hold different numbers of
/// microseconds.
struct PhaseTest {
  static constexpr int kBins = 64;

  double frequency_hz = 0;
  std::uint64_t events = 0;  ///< number of tested events: all, or a random part
  double periods = 0;        ///< between the first event and the last
  std::array<std::uint64_t, kBins> histogram{};
  double chi2_per_dof = 0;
  double neighbours_chi2_per_dof = 0;  ///< the median, before it is limited to 1
  double p_value = 1;
  double modulation = 0;
  double fraction_at_peak =
      0;  ///< of the events within 1 % of a period from the middle of the fullest bin; 0.02 if even
  Banding banding = Banding::unknown;
};

/// `times` must be in order, ns; 0 < frequency_hz < 1e8.
PhaseTest test_phase(std::span<const TimeNs> times, double frequency_hz);

/// Frequencies to search. Periods of frames are in the default range.
struct FrequencyRange {
  double lowest_hz = 10, highest_hz = 2000;
};

/// The frequency that the time stamps prefer, in a range that begins at 20 periods in the recording or above:
///
///   z(f) = |sum over i of w_i exp(2 pi j f t_i)|^2 / sum of w_i^2,    w_i = sin^2(pi (t_i - t_0) / T)
///
/// This is Rayleigh's statistic with a Hann taper, exponentially distributed with mean 1 for a Poisson process. It is
/// computed at all multiples of 1 / T by a Fourier transform of bins of a fifth of the shortest period, and divided by
/// the typical z of nearby frequencies: their median / ln 2, but at least 1. Bands have harmonics: of all frequencies
/// with at least a quarter of the highest ratio, the lowest is taken, and then divided by the largest integer up to 16
/// that yields another significant frequency with at least 1/64 of the highest ratio. The maximum near it is found from
/// the time stamps themselves. With its ratio r, p = min(1, candidates exp(-r)): with Bonferroni's correction, p is 1
/// if the strongest frequency is no stronger than expected by chance.
struct Periodicity {
  double frequency_hz = 0;
  double rayleigh = 0;         ///< z
  std::size_t candidates = 0;  ///< number of frequencies that were searched
  double p_value = 1;          ///< corrected for the number of candidates
  bool found() const;          ///< p < 1e-6
};

/// `times` must be in order, ns; only the first 1.6 million shortest periods are searched, 800 s of the default range.
/// Nothing if there are fewer than 100 time stamps or fewer than 20 of the shortest periods.
std::optional<Periodicity> find_periodicity(std::span<const TimeNs> times, const FrequencyRange& range = {});

}  // namespace esim::inline stats
