#include "esim/stats/periodicity.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <vector>

#include "esim/stats/numerics/median.h"
#include "esim/stats/numerics/probability.h"
#include "esim/stats/stream_sample.h"

namespace esim::inline stats {
namespace {

constexpr std::size_t kMinEvents = 100;
constexpr double kMinPeriods = 20;

constexpr int kNeighbours = 16;  // on either side
constexpr double kBandingP = 1e-4;
constexpr double kStrongModulation = 0.1;

constexpr double kFoundP = 1e-6;
constexpr double kBinsPerPeriod = 5, kMaxSearchBins = 8e6;
constexpr std::size_t kRefinedEvents = 1 << 17;

double span_s(std::span<const TimeNs> times) { return times.empty() ? 0.0 : to_seconds(times.back() - times.front()); }

std::vector<TimeNs> spread_over_microseconds(std::span<const TimeNs> times) {
  std::vector<TimeNs> spread(times.begin(), times.end());
  if (!std::all_of(times.begin(), times.end(), [](TimeNs t) { return t % kNsPerUs == 0; })) return spread;
  for (std::size_t i = 0; i < spread.size(); ++i) spread[i] += static_cast<TimeNs>(hash_index(i) % kNsPerUs);
  return spread;
}

// Phases in units of 2^-64, so that integer overflow is the modulo operation.
class Phase {
 public:
  explicit Phase(double frequency_hz)
      : turn_per_ns_(static_cast<std::uint64_t>(std::ldexp(static_cast<long double>(frequency_hz) * 1e-9L, 64))) {}
  std::uint64_t operator()(TimeNs t) const { return static_cast<std::uint64_t>(t) * turn_per_ns_; }

 private:
  std::uint64_t turn_per_ns_;
};

std::array<std::uint64_t, PhaseTest::kBins> phase_histogram(const std::vector<TimeNs>& times, double frequency_hz) {
  static_assert(PhaseTest::kBins == 64);
  const Phase phase(frequency_hz);
  std::array<std::uint64_t, PhaseTest::kBins> histogram{};
  for (const TimeNs t : times) ++histogram[phase(t) >> 58];
  return histogram;
}

double chi2_of(const std::array<std::uint64_t, PhaseTest::kBins>& histogram, std::size_t events) {
  const double expected = static_cast<double>(events) / PhaseTest::kBins;
  double chi2 = 0;
  for (const std::uint64_t count : histogram) {
    const double excess = static_cast<double>(count) - expected;
    chi2 += excess * excess / expected;
  }
  return chi2;
}

double fraction_near(const std::vector<TimeNs>& times, double frequency_hz, std::size_t bin) {
  const Phase phase(frequency_hz);
  const std::uint64_t centre = (2 * std::uint64_t{bin} + 1) << 57;
  const auto within = static_cast<std::uint64_t>(std::ldexp(0.01, 64));
  const auto near =
      std::count_if(times.begin(), times.end(), [&](TimeNs t) { return phase(t) - centre + within <= 2 * within; });
  return static_cast<double>(near) / static_cast<double>(times.size());
}

// Time stamps with Hann's taper over their span.
class Tapered {
 public:
  explicit Tapered(std::span<const TimeNs> times) : times_(times) {
    const double span = span_s(times);
    for (const TimeNs t : times) {
      const double sine = std::sin(std::numbers::pi * to_seconds(t - times.front()) / span);
      weights_.push_back(sine * sine);
    }
  }

  std::span<const TimeNs> times() const { return times_; }
  const std::vector<double>& weights() const { return weights_; }

  // z(f) from every stride-th time stamp.
  double rayleigh(double frequency_hz, std::size_t stride) const {
    const Phase phase(frequency_hz);
    double real = 0, imaginary = 0, weights2 = 0;
    for (std::size_t i = 0; i < times_.size(); i += stride) {
      const double angle = std::ldexp(2 * std::numbers::pi, -64) * static_cast<double>(phase(times_[i]));
      real += weights_[i] * std::cos(angle);
      imaginary += weights_[i] * std::sin(angle);
      weights2 += weights_[i] * weights_[i];
    }
    return weights2 > 0 ? (real * real + imaginary * imaginary) / weights2 : 0.0;
  }

 private:
  std::span<const TimeNs> times_;
  std::vector<double> weights_;
};

struct Spectrum {
  std::vector<double> z;  // at multiples of step_hz
  double step_hz = 0;
};

Spectrum compute_spectrum(const Tapered& tapered, double bin_s) {
  const std::span<const TimeNs> times = tapered.times();
  const int size = cv::getOptimalDFTSize(static_cast<int>(span_s(times) / bin_s) + 2);
  cv::Mat bins = cv::Mat::zeros(1, size, CV_32F), packed;
  double weights2 = 0;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const double w = tapered.weights()[i];
    bins.at<float>(0, static_cast<int>(to_seconds(times[i] - times.front()) / bin_s)) += static_cast<float>(w);
    weights2 += w * w;
  }
  cv::dft(bins, packed);  // real, then real and imaginary parts in turn
  Spectrum spectrum;
  spectrum.step_hz = 1.0 / (bin_s * size);
  spectrum.z.resize(static_cast<std::size_t>((size - 1) / 2 + 1));
  for (int k = 1; 2 * k < size; ++k) {
    const double real = packed.at<float>(0, 2 * k - 1), imaginary = packed.at<float>(0, 2 * k);
    spectrum.z[static_cast<std::size_t>(k)] = (real * real + imaginary * imaginary) / weights2;
  }
  return spectrum;
}

// The typical z of each frequency's neighbourhood, which spans a quarter of it or 32 values.
std::vector<double> typical(const std::vector<double>& z, std::size_t first, std::size_t end) {
  std::vector<double> level(z.size(), 1.0);
  for (std::size_t begin = first; begin < end;) {
    std::size_t stop = std::min(end, std::max(begin + begin / 4, begin + 32));
    if (end - stop < 32) stop = end;
    const auto at = [&](std::size_t k) { return z.begin() + static_cast<std::ptrdiff_t>(k); };
    const double value = std::max(1.0, median({at(begin), at(stop)}) / std::numbers::ln2);
    std::fill(level.begin() + static_cast<std::ptrdiff_t>(begin), level.begin() + static_cast<std::ptrdiff_t>(stop),
              value);
    begin = stop;
  }
  return level;
}

// A strong frequency of the bands, and the harmonic that it is.
struct Line {
  std::size_t k = 0;
  std::size_t harmonic = 1;
};

Line find_line(const std::vector<double>& z, const std::vector<double>& level, std::size_t first, std::size_t end) {
  std::vector<double> ratio(z.size());
  for (std::size_t k = first; k < end; ++k) ratio[k] = z[k] / level[k];
  const double highest = *std::max_element(ratio.begin(), ratio.end());
  std::size_t line = first;
  while (ratio[line] < 0.25 * highest) ++line;

  const double min = std::max(highest / 64, std::log(static_cast<double>(end - first) / kFoundP));
  for (std::size_t divisor = 16; divisor > 1; --divisor) {
    const std::size_t k = (line + divisor / 2) / divisor;
    if (k < first + 2) continue;
    const auto nearby = ratio.begin() + static_cast<std::ptrdiff_t>(k);
    if (*std::max_element(nearby - 2, nearby + 3) >= min) return {line, divisor};
  }
  return {line, 1};
}

// Maximum of z within `reach_hz` of a frequency, by successive refinement.
double refine(const Tapered& tapered, std::size_t stride, double frequency_hz, double reach_hz) {
  constexpr int kSteps = 8;
  for (int zoom = 0; zoom < 4; ++zoom, reach_hz /= kSteps / 2) {
    const double centre_hz = frequency_hz;
    double best = -1;
    for (int step = -kSteps; step <= kSteps; ++step) {
      const double candidate_hz = centre_hz + reach_hz * step / kSteps;
      const double z = tapered.rayleigh(candidate_hz, stride);
      if (z > best) {
        best = z;
        frequency_hz = candidate_hz;
      }
    }
  }
  return frequency_hz;
}

}  // namespace

bool Periodicity::found() const { return p_value < kFoundP; }

PhaseTest test_phase(std::span<const TimeNs> given, double frequency_hz) {
  PhaseTest test;
  test.frequency_hz = frequency_hz;
  test.events = given.size();
  test.periods = span_s(given) * frequency_hz;
  const std::vector<TimeNs> times = spread_over_microseconds(given);
  test.histogram = phase_histogram(times, frequency_hz);
  if (times.size() < kMinEvents || test.periods < kMinPeriods) return test;

  constexpr double kDof = PhaseTest::kBins - 1;
  const double chi2 = chi2_of(test.histogram, times.size());
  std::vector<double> neighbours;
  for (int i = 1; i <= kNeighbours; ++i) {
    const double golden = i * std::numbers::phi;  // no frequency is a simple multiple of another
    const double offset = 0.1 + 0.2 * (golden - std::floor(golden));
    for (const double factor : {1 - offset, 1 + offset}) {
      neighbours.push_back(chi2_of(phase_histogram(times, factor * frequency_hz), times.size()) / kDof);
    }
  }
  test.chi2_per_dof = chi2 / kDof;
  test.neighbours_chi2_per_dof = median(std::move(neighbours));
  const double inflation = std::max(1.0, test.neighbours_chi2_per_dof);
  test.p_value = chi2_tail(chi2 / inflation, kDof);
  test.modulation = std::sqrt(std::max(0.0, chi2 - kDof * inflation) / static_cast<double>(times.size()));
  const auto fullest = std::max_element(test.histogram.begin(), test.histogram.end()) - test.histogram.begin();
  test.fraction_at_peak = fraction_near(times, frequency_hz, static_cast<std::size_t>(fullest));
  test.banding = test.p_value >= kBandingP              ? Banding::none
                 : test.modulation >= kStrongModulation ? Banding::strong
                                                        : Banding::weak;
  return test;
}

std::optional<Periodicity> find_periodicity(std::span<const TimeNs> times, const FrequencyRange& range) {
  if (times.empty()) return std::nullopt;
  const double bin_s = 1 / (kBinsPerPeriod * range.highest_hz);
  const TimeNs end_ns = times.front() + to_ns(kMaxSearchBins * bin_s);
  times = times.first(static_cast<std::size_t>(std::upper_bound(times.begin(), times.end(), end_ns) - times.begin()));
  const double lowest_hz = std::max(range.lowest_hz, kMinPeriods / span_s(times));
  if (times.size() < kMinEvents || !(lowest_hz < range.highest_hz)) return std::nullopt;

  const Tapered tapered(times);
  const Spectrum spectrum = compute_spectrum(tapered, bin_s);
  const auto first = static_cast<std::size_t>(std::ceil(lowest_hz / spectrum.step_hz));
  const auto end = std::min(spectrum.z.size(), static_cast<std::size_t>(range.highest_hz / spectrum.step_hz) + 1);
  if (end <= first) return std::nullopt;
  const std::vector<double> level = typical(spectrum.z, first, end);
  const Line line = find_line(spectrum.z, level, first, end);

  const double harmonic_hz = refine(tapered, 1 + times.size() / kRefinedEvents,
                                    static_cast<double>(line.k) * spectrum.step_hz, 2 * spectrum.step_hz);
  Periodicity result;
  result.frequency_hz = harmonic_hz / static_cast<double>(line.harmonic);
  result.rayleigh = tapered.rayleigh(result.frequency_hz, 1);
  const double typical_z = level[(line.k + line.harmonic / 2) / line.harmonic];
  result.candidates = end - first;
  result.p_value = std::min(1.0, static_cast<double>(result.candidates) * std::exp(-result.rayleigh / typical_z));
  return result;
}

}  // namespace esim::inline stats
