#include "esim/fit/circuit/circuit_simulation.h"

#include <cmath>
#include <numbers>

#include "esim/core/parallel.h"
#include "esim/event_camera/event_camera.h"

namespace esim::inline fit {

EventCameraOptions on_bench(EventCameraOptions sensor) {
  sensor.readout = {}, sensor.filters = {}, sensor.labels = false;
  sensor.hot_pixels = sensor.dead_pixels = 0;
  CircuitOptions& c = *sensor.circuit;
  c.white_lux = 4 * c.f_number * c.f_number / c.transmission;
  return sensor;
}

PixelCounts simulate_counts(const EventCameraOptions& sensor, const KnownLight& light, double settling, double extent,
                            int side, std::uint64_t seed, int points) {
  EventCamera camera(sensor, side, side, seed);
  const Workers workers(1);
  std::vector<Event> events;
  PixelCounts result{light, Image<PixelCounts::Pixel>(side, side), extent};
  const auto show = [&](double lux, double t_s) {
    camera.process(Image<float>(side, side, static_cast<float>(lux)), to_ns(t_s), events, workers);
  };
  const auto flicker = [&](double first_period, double periods, int corners) {
    // The fundamental of the polygon is sinc^2(1 / corners) of that of the light.
    const double angle = std::numbers::pi / corners, scale = std::pow(angle / std::sin(angle), 2);
    const auto count = static_cast<int>(std::lround(periods * corners));
    for (int k = 1; k <= count; ++k) {
      const double phase = static_cast<double>(k) / corners,
                   relative = 1 + light.modulation * std::sin(2 * std::numbers::pi * phase);
      show(light.lux * std::pow(relative, scale), (first_period + phase) / light.frequency_hz);
    }
  };
  show(light.lux, 0);
  if (light.flickers()) {
    const double first = std::ceil(settling);
    flicker(0, first, points / 2);
    events.clear();
    flicker(first, extent, points);
  } else {
    if (settling > 0) show(light.lux, settling);
    events.clear();
    show(light.lux, settling + extent);
  }
  for (const Event& event : events) {
    PixelCounts::Pixel& pixel = result.pixels(event.x, event.y);
    ++(event.polarity > 0 ? pixel.on : pixel.off);
  }
  return result;
}

}  // namespace esim::inline fit
