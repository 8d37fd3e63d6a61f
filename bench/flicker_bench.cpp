// Segments of a grey wall in flickering light to ordered events, on one thread: the cost of flicker
// (docs/methods/light.md). Arguments: width, height, depth and contrast threshold in hundredths; depth 0 is constant
// light, without the stage.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <optional>

#include "esim/event_camera/event_camera.h"
#include "esim/light/flicker.h"

namespace esim {
namespace {

constexpr int kSegments = 10;
constexpr TimeNs kInterval = 10 * kNsPerMs;  // uniform sampling at 100 Hz

void run_flicker(benchmark::State& state, EventCameraOptions options, FlickerShape shape) {
  const int width = static_cast<int>(state.range(0)), height = static_cast<int>(state.range(1));
  const double depth = static_cast<double>(state.range(2)) * 0.01;
  options.contrast_threshold = static_cast<double>(state.range(3)) * 0.01;
  const LightAccuracy accuracy{1e-3 * options.min_threshold(), options.dark_light()};
  const Image<float> grey(width, height, 0.2F);
  const Workers workers(1);
  std::size_t count = 0;
  for (auto _ : state) {
    state.PauseTiming();
    EventCamera camera(options, width, height, 1, 0);
    std::optional<Flicker> flicker;
    if (depth > 0)
      flicker.emplace(SceneLight(Modulation({.depth = depth, .shape = shape}, 0, accuracy)), accuracy.dark);
    state.ResumeTiming();
    for (int k = 0; k <= kSegments; ++k) {
      const Segment segment{grey.bounds(), std::max(k - 1, 0) * kInterval, k * kInterval, &grey, &grey};
      if (flicker) {
        flicker->look(std::span(&segment, 1), width, height, [](TimeNs, const Tile&, Sample&) {});
        flicker->divide(segment.t1, workers, [&](std::span<const Segment> divided, TimeNs watermark) {
          camera.integrate(divided, watermark, workers);
        });
      } else {
        camera.integrate(std::span(&segment, 1), segment.t1, workers);
      }
      count += camera.release_until(segment.t1).size();
    }
  }
  const double simulated_s = static_cast<double>(state.iterations()) * kSegments * to_seconds(kInterval);
  state.counters["s/s"] = benchmark::Counter(simulated_s, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.counters["Mev/s"] = static_cast<double>(count) / simulated_s * 1e-6;  // per simulated second
}

/// Pixels without noise.
void mains(benchmark::State& state) { run_flicker(state, {}, FlickerShape::mains); }
void pwm(benchmark::State& state) { run_flicker(state, {}, FlickerShape::pwm); }

/// Processor time of the fastest of several runs: what the rest of the machine does not slow.
void fastest(benchmark::internal::Benchmark* benchmark) {
  benchmark->Unit(benchmark::kMillisecond)->Repetitions(5)->MinTime(0.01)->ReportAggregatesOnly();
  benchmark->ComputeStatistics("min",
                               [](const std::vector<double>& v) { return *std::min_element(v.begin(), v.end()); });
}

void ideal_cases(benchmark::internal::Benchmark* benchmark) {
  benchmark->Args({346, 260, 0, 20})->Args({346, 260, 10, 20})->Args({346, 260, 50, 50})->Args({346, 260, 50, 20});
  fastest(benchmark);
}

void one_case(benchmark::internal::Benchmark* benchmark) {
  benchmark->Args({346, 260, 50, 20});
  fastest(benchmark);
}

BENCHMARK(mains)->Apply(ideal_cases);
BENCHMARK(pwm)->Apply(one_case);

}  // namespace
}  // namespace esim
