// Frames and events from the same samples on one thread: 4,000 samples per second, 25 frames per second of 20 ms
// each. Arguments: width, height, noise or none. "ns/px" is of the frame camera, per pixel and sample; "fraction" is
// its time over that of the event camera.
#include <benchmark/benchmark.h>

#include <chrono>

#include "esim/event_camera/event_camera.h"
#include "esim/frame_camera/frame_camera.h"
#include "moving_texture.h"

namespace esim {
namespace {

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

void frames(benchmark::State& state) {
  constexpr int kSamples = 160;
  constexpr TimeNs kInterval = kNsPerSecond / 4000;
  const int width = static_cast<int>(state.range(0)), height = static_cast<int>(state.range(1));
  const auto images = bench::moving_texture(width, height, kSamples);
  FrameCameraOptions options;
  options.rate_hz = 25, options.exposure_s = 0.02;
  if (state.range(2) != 0) options.shot_noise = true, options.read_noise_e = 5;
  FrameCamera frame_camera(options, width, height, {0, 1000 * kNsPerSecond});
  EventCamera event_camera(EventCameraOptions{}, width, height);
  const Workers workers(1);

  // There and back again, so that nothing jumps.
  std::size_t sample = 0;
  TimeNs t = 0;
  double for_events = 0, for_frames = 0;
  const auto image = [&](std::size_t k) -> const Image<float>& {
    const std::size_t at = k % (2 * kSamples - 2);
    return images[at < kSamples ? at : 2 * kSamples - 2 - at];
  };
  for (auto _ : state) {
    for (int i = 0; i < kSamples; ++i, ++sample, t += kInterval) {
      const Segment segment{images[0].bounds(), sample == 0 ? t : t - kInterval, t,
                            &image(sample == 0 ? 0 : sample - 1), &image(sample)};
      const double start = seconds();
      event_camera.integrate({&segment, 1}, t, workers);
      benchmark::DoNotOptimize(event_camera.release_until(t));
      const double between = seconds();
      frame_camera.integrate({&segment, 1}, t, workers);
      while (frame_camera.due() <= t) benchmark::DoNotOptimize(frame_camera.take());
      for_events += between - start, for_frames += seconds() - between;
    }
  }
  const double pixels = static_cast<double>(sample) * static_cast<double>(width * height);
  state.counters["ns/px"] = for_frames / pixels * 1e9;
  state.counters["fraction"] = for_frames / for_events;
}

BENCHMARK(frames)->Args({346, 260, 0})->Args({346, 260, 1})->Args({1280, 720, 0})->Args({1280, 720, 1});

}  // namespace
}  // namespace esim
