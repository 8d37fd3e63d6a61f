// The loop of overhead.py in C++.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "esim/core/parallel.h"
#include "esim/event_camera/event_camera.h"

int main(int, char** arguments) {
  constexpr int kWidth = 346, kHeight = 260, kFrames = 100;
  std::vector<esim::Image<float>> frames;
  for (int k = 0; k < kFrames; ++k) {
    esim::Image<float> frame(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x)
        frame(x, y) =
            0.5F + 0.4F * std::sin(0.1F * static_cast<float>(x - k)) * std::sin(0.13F * static_cast<float>(y));
    }
    frames.push_back(frame);
  }
  const esim::Workers workers(1);
  esim::EventCamera camera(esim::preset_options(arguments[1]), kWidth, kHeight);
  const auto began = std::chrono::steady_clock::now();
  std::size_t count = 0;
  for (int k = 0; k < kFrames; ++k) {
    std::vector<esim::Event> events;
    camera.process(frames[static_cast<std::size_t>(k)], k * esim::kNsPerMs, events, workers);
    count += events.size();
  }
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - began;
  std::printf("%.9f %zu\n", seconds.count() / kFrames, count);
}
