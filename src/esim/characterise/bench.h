#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "esim/event_camera/options.h"
#include "esim/events/event.h"

namespace esim::inline characterise {

/// Uniform light on all pixels, at one time. Between two points, the logarithm of the light is linear.
struct LightPoint {
  TimeNs t = 0;
  double lux = 0;  ///< illuminance of the sensor
};

/// A sensor on a test bench. `record` shows it light, from a first point at time 0 to the last point, and returns the
/// events in order of time. The sensor is a simulation, or a recording for which the same light was shown.
struct SensorUnderTest {
  int width = 0, height = 0;
  std::function<std::vector<Event>(std::span<const LightPoint>)> record;
};

/// A simulated sensor. It keeps its state between recordings, so that their noise is independent. Pixels without
/// `circuit` take the irradiance for the illuminance. `threads` as in Workers. Throws UserError as EventCamera does.
SensorUnderTest simulated_sensor(const EventCameraOptions& options, int width, int height, std::uint64_t seed = 0,
                                 int threads = 1);

/// The light of a recording, one piece after another.
class Light {
 public:
  explicit Light(double lux) : points_{{0, lux}} {}

  double now_s() const { return to_seconds(points_.back().t); }
  /// Keeps the light for a time. The points are closer near the start, where pixels still respond to what was before.
  void keep(double duration_s) {
    const LightPoint from = points_.back();
    for (double after_s = 1e-6; after_s < duration_s / 1.4; after_s *= 1.4)
      points_.push_back({from.t + to_ns(after_s), from.lux});
    points_.push_back({from.t + to_ns(duration_s), from.lux});
  }
  /// Changes the light within 1 us.
  void step_to(double lux) { move_to(lux, 1e-6); }
  /// Changes the logarithm of the light linearly.
  void move_to(double lux, double duration_s) { points_.push_back({points_.back().t + to_ns(duration_s), lux}); }

  const std::vector<LightPoint>& points() const { return points_; }

 private:
  std::vector<LightPoint> points_;
};

}  // namespace esim::inline characterise
