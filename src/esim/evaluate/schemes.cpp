#include "esim/evaluate/schemes.h"

#include <algorithm>

#include "esim/scenario/sampling_text.h"

namespace esim::inline evaluate {
namespace {

std::vector<SamplingOptions> read_all(const std::vector<std::string>& texts) {
  std::vector<SamplingOptions> schemes;
  for (const std::string& text : texts) schemes.push_back(read_sampling(text));
  return schemes;
}

}  // namespace

std::vector<SamplingOptions> default_schemes() {
  std::vector<SamplingOptions> schemes;
  for (const double rate_hz : {100, 500, 1000, 2000, 3000}) schemes.push_back(UniformSampling{rate_hz});
  for (const double lambda : {4.0, 2.0, 1.0, 0.5}) schemes.push_back(BrightnessSampling{lambda, {}});
  for (const double lambda : {4.0, 2.0, 1.0, 0.5, 0.35}) schemes.push_back(FlowSampling{lambda, {}});
  for (const double tolerance : {0.4, 0.2, 0.1}) schemes.push_back(AdaptiveSampling{.tolerance = tolerance});
  const std::size_t listed = schemes.size();
  for (const std::string& type : sampling_types()) {
    const SamplingOptions scheme = read_sampling(type);
    const bool known = std::any_of(schemes.begin(), schemes.begin() + static_cast<std::ptrdiff_t>(listed),
                                   [&](const SamplingOptions& other) { return other.index() == scheme.index(); });
    if (!known) schemes.push_back(scheme);
  }
  return schemes;
}

std::vector<SamplingOptions> quick_schemes() {
  return read_all(
      {"uniform rate_hz=250", "uniform rate_hz=1000", "brightness lambda=2", "flow lambda=4", "flow lambda=1"});
}

void make_quick(Scenario& scenario, SamplingEvaluationOptions& options) {
  constexpr double kLongest_s = 0.6;
  if (!scenario.duration_s || *scenario.duration_s > kLongest_s) scenario.duration_s = kLongest_s;
  options.window_s = std::min(options.window_s, 0.2);
  options.pixels = options.pixels == 0 ? 100 : std::min(options.pixels, 100);
  options.truth_rate_hz = std::min(options.truth_rate_hz, 5000.0);
  options.event_rate_hz = std::min(options.event_rate_hz, 20000.0);
  options.event_span_s = std::min(options.event_span_s, 0.02);
}

}  // namespace esim::inline evaluate
