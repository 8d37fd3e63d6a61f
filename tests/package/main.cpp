// Events from a user's own frames, with the installed library.
#include <esim/compose/compose.h>
#include <esim/event_camera/event_camera.h>

#include <cstdio>

int main() {
  const esim::Workers workers(1);
  esim::EventCamera camera({.contrast_threshold = 0.2}, 4, 3, 0, 0);
  const esim::Image<float> dark(4, 3, 0.1F), bright(4, 3, 0.3F);
  const esim::Segment first{dark.bounds(), 0, 0, &dark, &dark}, second{dark.bounds(), 0, 1'000'000, &dark, &bright};
  camera.integrate(std::span(&first, 1), 0, workers);
  camera.integrate(std::span(&second, 1), second.t1, workers);
  const esim::EventSpan events = camera.release_until(1'000'000);
  std::printf("%zu events, %zu bytes of options\n", events.size(), sizeof(esim::Scenario));
  return events.size() == 12 * 5 ? 0 : 1;  // ln(0.301 / 0.101) = 5.46 thresholds
}
