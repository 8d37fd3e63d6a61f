#include "esim/characterise/bench.h"

#include <memory>

#include "esim/core/image.h"
#include "esim/core/parallel.h"
#include "esim/event_camera/event_camera.h"

namespace esim::inline characterise {
namespace {

double irradiance_of_a_lux(const EventCameraOptions& options) {
  if (!options.circuit) return 1;
  return options.circuit->photocurrent_fa_per_lux / options.circuit->white_photocurrent_fa();
}

struct Simulation {
  Simulation(const EventCameraOptions& options, int width, int height, std::uint64_t seed, int threads)
      : camera(options, width, height, seed), workers(threads), irradiance_per_lux(irradiance_of_a_lux(options)) {}

  EventCamera camera;
  Workers workers;
  double irradiance_per_lux;
  TimeNs next = 0;  // start of the next recording
};

}  // namespace

SensorUnderTest simulated_sensor(const EventCameraOptions& options, int width, int height, std::uint64_t seed,
                                 int threads) {
  const auto simulation = std::make_shared<Simulation>(options, width, height, seed, threads);
  const auto record = [=](std::span<const LightPoint> light) {
    std::vector<Event> events;
    Image<float> image(width, height);
    const TimeNs start = simulation->next;
    for (const LightPoint& point : light) {
      image.fill(static_cast<float>(point.lux * simulation->irradiance_per_lux));
      simulation->camera.process(image, start + point.t, events, simulation->workers);
      simulation->next = start + point.t + kNsPerUs;
    }
    std::erase_if(events, [&](const Event& event) { return event.t < start; });
    for (Event& event : events) event.t -= start;
    return events;
  };
  return {width, height, record};
}

}  // namespace esim::inline characterise
