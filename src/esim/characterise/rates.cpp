#include "esim/characterise/rates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "esim/core/error.h"
#include "esim/stats/sensor/sensor_statistics.h"

namespace esim::inline characterise {
namespace {

std::vector<Event> part_of(const std::vector<Event>& events, TimeNs from, TimeNs to) {
  std::vector<Event> part;
  std::copy_if(events.begin(), events.end(), std::back_inserter(part),
               [&](const Event& event) { return event.t > from && event.t <= to; });
  return part;
}

/// The mean interval between events of a pixel, s.
double mean_interval_s(const std::vector<Event>& events, int width, int height, double rate) {
  std::vector<TimeNs> last(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), -1);
  double sum = 0, count = 0;
  for (const Event& event : events) {
    TimeNs& before = last[static_cast<std::size_t>(event.y) * static_cast<std::size_t>(width) + event.x];
    if (before >= 0) sum += to_seconds(event.t - before), count += 1;
    before = event.t;
  }
  if (count > 0) return sum / count;
  throw UserError(
      fmt::format("no pixel fires twice while the light rises at {:.3g} per second; increase the contrast", rate));
}

}  // namespace

NoiseRates measure_noise(const SensorUnderTest& sensor, double lux, double settle_s, double duration_s) {
  Light light(lux);
  light.keep(settle_s);
  const TimeNs from = light.points().back().t;
  light.keep(duration_s);
  SensorStatisticsCounter counter(SensorSize{sensor.width, sensor.height});
  NoiseRates rates;
  rates.lux = lux;
  rates.pixels_on_hz.resize(static_cast<std::size_t>(sensor.width) * static_cast<std::size_t>(sensor.height));
  rates.pixels_off_hz = rates.pixels_on_hz;
  const std::vector<Event> events = part_of(sensor.record(light.points()), from, light.points().back().t);
  counter.add(events);
  for (const Event& event : events) {
    const std::size_t pixel = static_cast<std::size_t>(event.y) * static_cast<std::size_t>(sensor.width) + event.x;
    (event.polarity > 0 ? rates.pixels_on_hz : rates.pixels_off_hz)[pixel] += 1 / duration_s;
  }
  const SensorStatistics statistics = std::move(counter).finish();
  const double exposure_s = duration_s * static_cast<double>(rates.pixels_on_hz.size());
  rates.on_hz = static_cast<double>(statistics.on) / exposure_s;
  rates.off_hz = static_cast<double>(statistics.events - statistics.on) / exposure_s;
  rates.alternating = 1 - statistics.alike_fraction();
  return rates;
}

Refractory measure_refractory(const SensorUnderTest& sensor, double lux, double contrast, std::span<const double> rates,
                              double settle_s) {
  // A line through the intervals over 1 / rate, by least squares.
  double n = 0, x1 = 0, x2 = 0, y1 = 0, xy = 0;
  for (const double rate : rates) {
    Light light(lux);
    light.keep(settle_s);
    const double middle = lux * std::exp(0.5 * contrast), half_s = 0.5 * contrast / rate;
    light.move_to(middle, half_s);
    const TimeNs from = light.points().back().t;
    light.move_to(lux * std::exp(contrast), half_s);
    const TimeNs to = light.points().back().t;
    light.move_to(lux, settle_s);
    light.keep(settle_s);
    const double interval_s =
        mean_interval_s(part_of(sensor.record(light.points()), from, to), sensor.width, sensor.height, rate);
    n += 1, x1 += 1 / rate, x2 += 1 / (rate * rate), y1 += interval_s, xy += interval_s / rate;
  }
  const double spread = n * x2 - x1 * x1;
  if (!(spread > 0)) throw UserError("a refractory period needs intervals at two different rates of the light");
  const double threshold = (n * xy - x1 * y1) / spread;
  return {(y1 - threshold * x1) / n, threshold};
}

}  // namespace esim::inline characterise
