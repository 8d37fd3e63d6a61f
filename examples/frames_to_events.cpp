// Events from frames in memory: a bright bar that crosses the image.
#include <esim/event_camera/event_camera.h>

#include <cstdio>

int main() {
  constexpr int kWidth = 64, kHeight = 48, kFrames = 200;
  const esim::Workers workers(0);
  esim::EventCamera camera({.contrast_threshold = 0.2}, kWidth, kHeight);
  std::vector<esim::Event> events;
  for (int k = 0; k < kFrames; ++k) {
    esim::Image<float> image(kWidth, kHeight, 0.1F);
    for (int y = 0; y < kHeight; ++y) image(k % kWidth, y) = 0.8F;
    camera.process(image, k * esim::kNsPerMs, events, workers);
  }
  std::printf("%zu events in %d frames\n", events.size(), kFrames);
  for (std::size_t i = 0; i < 3 && i < events.size(); ++i) {
    const esim::Event& event = events[i];
    std::printf("t = %.6f s, x = %d, y = %d, %s\n", esim::to_seconds(event.t), event.x, event.y,
                event.polarity > 0 ? "ON" : "OFF");
  }
}
