#include "esim/characterise/trials.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "esim/core/error.h"

namespace esim::inline characterise {
namespace {

constexpr int kPointsPerPeriod = 48;

struct Trial {
  std::size_t contrast;
  TimeNs pulse, change, end;
};

void add_sinusoid(const TrialProtocol& protocol, double contrast, Light& light) {
  constexpr int kSwelling = TrialProtocol::kSwellingPeriods * kPointsPerPeriod;
  for (int i = 1; i <= TrialProtocol::kSinePeriods * kPointsPerPeriod; ++i) {
    const double swelling = i < kSwelling ? 0.5 - 0.5 * std::cos(std::numbers::pi * i / kSwelling) : 1.0;
    const double phase = 2 * std::numbers::pi * i / kPointsPerPeriod;
    light.move_to(protocol.lux * std::exp(contrast * swelling * std::sin(phase)),
                  1 / (kPointsPerPeriod * protocol.frequency_hz));
  }
}

// The contrasts take turns, so that a slow drift affects all of them alike.
std::vector<Trial> run_trials(const TrialProtocol& protocol, Light& light) {
  const auto now = [&] { return light.points().back().t; };
  std::vector<Trial> trials;
  light.keep(protocol.settle_s);
  for (int repeat = 0; repeat < protocol.repeats; ++repeat) {
    for (std::size_t k = 0; k < protocol.contrasts.size(); ++k) {
      Trial trial{k, now(), 0, 0};
      light.step_to(protocol.lux * std::exp(protocol.pulse_contrast));
      light.keep(protocol.pulse_s);
      light.step_to(protocol.lux);
      light.keep(protocol.settle_s);
      trial.change = now();
      if (protocol.frequency_hz > 0) {
        add_sinusoid(protocol, protocol.contrasts[k], light);
      } else {
        light.move_to(protocol.lux * std::exp(protocol.contrasts[k]), protocol.change_s);
        light.keep(protocol.window_s - protocol.change_s);
      }
      trial.end = now();
      light.step_to(protocol.lux);
      light.keep(protocol.settle_s);
      trials.push_back(trial);
    }
  }
  return trials;
}

}  // namespace

TrialProtocol TrialProtocol::steps(double lux, std::vector<double> contrasts, int repeats, double response_time_s,
                                   double refractory_s) {
  TrialProtocol protocol;
  protocol.lux = lux;
  protocol.contrasts = std::move(contrasts);
  protocol.repeats = repeats;
  protocol.pulse_s = 2 * response_time_s;
  protocol.settle_s = refractory_s + 8 * response_time_s;
  protocol.window_s = 20 * response_time_s;
  return protocol;
}

double TrialCounts::fraction(std::size_t contrast) const {
  double all = 0, responses = 0;
  for (std::size_t i = contrast; i < trials.size(); i += protocol.contrasts.size())
    all += trials[i], responses += fired[i];
  return all > 0 ? responses / all : std::numeric_limits<double>::quiet_NaN();
}

double TrialCounts::median_latency_s(std::size_t contrast) const {
  std::size_t all = 0;
  for (std::size_t i = contrast; i < trials.size(); i += protocol.contrasts.size()) all += trials[i];
  std::vector<double> latencies = latencies_s[contrast];
  if (2 * latencies.size() <= all) return std::numeric_limits<double>::infinity();
  const auto middle = latencies.begin() + static_cast<std::ptrdiff_t>(all / 2);
  std::nth_element(latencies.begin(), middle, latencies.end());
  return *middle;
}

std::vector<LightPoint> light_of(const TrialProtocol& protocol) {
  Light light(protocol.lux);
  run_trials(protocol, light);
  return light.points();
}

TrialCounts count_responses(const TrialProtocol& protocol, const std::vector<Event>& events, int width, int height) {
  enum class State : std::uint8_t { idle, reset, spoiled, responded };
  Light light(protocol.lux);
  const std::vector<Trial> trials = run_trials(protocol, light);
  const std::size_t levels = protocol.contrasts.size();
  TrialCounts counts;
  counts.protocol = protocol;
  counts.pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  counts.fired.resize(counts.pixels * levels);
  counts.trials.resize(counts.pixels * levels);
  counts.latencies_s.resize(levels);
  const TimeNs pulse_ns = to_ns(protocol.pulse_s) + kNsPerUs;
  auto event = events.begin();
  for (const Trial& trial : trials) {
    const int polarity = protocol.contrasts[trial.contrast] > 0 ? 1 : -1;
    std::vector<State> states(counts.pixels, State::idle);
    while (event != events.end() && event->t <= trial.pulse) ++event;
    for (; event != events.end() && event->t <= trial.end; ++event) {
      const std::size_t pixel = static_cast<std::size_t>(event->y) * static_cast<std::size_t>(width) + event->x;
      State& state = states[pixel];
      if (event->t <= trial.change) {
        const bool by_pulse = state == State::idle && event->polarity > 0 && event->t <= trial.pulse + pulse_ns;
        state = by_pulse ? State::reset : State::spoiled;
      } else if (state == State::reset) {
        state = event->polarity == polarity ? State::responded : State::spoiled;
        if (state == State::responded)
          counts.latencies_s[trial.contrast].push_back(to_seconds(event->t - trial.change));
      }
    }
    for (std::size_t pixel = 0; pixel < counts.pixels; ++pixel) {
      const std::size_t i = pixel * levels + trial.contrast;
      counts.trials[i] += states[pixel] == State::reset || states[pixel] == State::responded;
      counts.fired[i] += states[pixel] == State::responded;
    }
  }
  if (std::accumulate(counts.trials.begin(), counts.trials.end(), std::uint64_t{0}) > 0) return counts;
  throw UserError(
      fmt::format("no trial at {:.3g} lux counts: each pixel must fire once at the pulse of {:.3g} s, and not again "
                  "before the change {:.3g} s later; make the refractory period longer than the pixel's response",
                  protocol.lux, protocol.pulse_s, protocol.settle_s));
}

TrialCounts measure(const SensorUnderTest& sensor, const TrialProtocol& protocol) {
  return count_responses(protocol, sensor.record(light_of(protocol)), sensor.width, sensor.height);
}

}  // namespace esim::inline characterise
