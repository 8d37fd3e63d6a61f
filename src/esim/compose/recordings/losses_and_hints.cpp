#include <fmt/format.h>

#include <algorithm>
#include <type_traits>

#include "esim/compose/compose.h"
#include "esim/event_camera/noise_rate.h"
#include "esim/files/number_text.h"
#include "esim/filters/chip_blocks.h"

namespace esim::inline compose {
namespace {

// A readout counts as saturated if more than this fraction of the events waited for it.
constexpr double kSaturated = 0.01;

double percent(std::int64_t part, std::int64_t whole) {
  return 100.0 * static_cast<double>(part) / static_cast<double>(std::max<std::int64_t>(whole, 1));
}

std::string grouped(std::int64_t count) { return esim::grouped(static_cast<std::uint64_t>(count)); }

void add_sensor(const std::string& name, const ReadoutOptions& readout, const EventCameraStatistics& sensor,
                std::vector<std::string>& lines) {
  const std::int64_t events = sensor.read_out;
  if (sensor.dropped > 0) {
    lines.push_back(
        fmt::format("{}the readout dropped {} of {} events ({:.3g} %), because its queue of {} events was full: raise "
                    "event_camera.readout.queue_events, or set it to 0 for one event per pixel",
                    name, grouped(sensor.dropped), grouped(events + sensor.dropped),
                    percent(sensor.dropped, events + sensor.dropped), readout.queue_events));
  }
  if (static_cast<double>(sensor.delayed) > kSaturated * static_cast<double>(events)) {
    lines.push_back(fmt::format(
        "{}the readout was saturated: {:.3g} % of the events waited for it, for up to {:.3g} ms, and their pixels were "
        "blind while they waited. Its limits are event_camera.readout.rate_mev_per_s ({:g} Mev/s) and "
        "event_camera.readout.row_time_us ({:g} us)",
        name, percent(sensor.delayed, events), to_seconds(sensor.longest_delay) * 1e3, readout.rate_mev_per_s,
        readout.row_time_us));
  }
  if (sensor.lost > 0) {
    lines.push_back(
        fmt::format("{}{} events were lost, because their pixels fire at most event_camera.circuit.max_rate_hz: set "
                    "refractory_period_us, or raise contrast_threshold above the noise",
                    name, grouped(sensor.lost)));
  }
}

void add_filtered(const std::string& name, const EventCameraStatistics& sensor, std::vector<FilteredCamera>& cameras) {
  if (!sensor.filtered.empty()) cameras.push_back({name, static_cast<std::uint64_t>(sensor.read_out), sensor.filtered});
}

template <typename Scheme>
double max_rate_hz(const Scheme& scheme) {
  if constexpr (std::is_same_v<Scheme, UniformSampling>) {
    return scheme.rate_hz;
  } else {
    return scheme.bounds.max_rate_hz;
  }
}

/// Whether edges move in steps of whole pixels, each of which `adaptive` tries to bisect.
bool has_stepping_edges(const Scenario& scenario) {
  const auto* mesh = std::get_if<MeshRendererOptions>(&scenario.renderer);
  return mesh && mesh->samples_per_pixel == 1;
}

void add_sampling(const std::string& name, const Scenario& scenario, const CameraOptions& camera,
                  const SamplingStatistics& sampling, std::vector<std::string>& lines) {
  if (sampling.held_to_max_rate > 0) {
    const bool steps = std::holds_alternative<AdaptiveSampling>(camera.sampling) && has_stepping_edges(scenario);
    const double rate = std::visit([](const auto& scheme) { return max_rate_hz(scheme); }, camera.sampling);
    lines.push_back(fmt::format(
        "{}{} intervals between samples were limited by sampling.max_rate_hz ({:g} Hz): the error there is larger than "
        "the sampling method allows. {}",
        name, grouped(sampling.held_to_max_rate), rate,
        steps ? "Set renderer.samples_per_pixel to 16: with 1, edges move in steps of whole pixels"
              : "Raise max_rate_hz, or move more slowly"));
  }
  const double budget = sampling.tolerance * strictest_sensor(scenario, camera).contrast_threshold;
  if (sampling.measured_error && sampling.measured_error->p99 > budget) {
    lines.push_back(fmt::format(
        "{}sampling missed its tolerance: the 99th percentile of the measured error is {:.3g} in brightness, "
        "sampling.tolerance ({:g} contrast thresholds) allows {:.3g}. Raise sampling.max_rate_hz",
        name, sampling.measured_error->p99, sampling.tolerance, budget));
  }
}

/// Motion between frames that the optical flow did not follow.
void add_motion(const ConversionSummary& summary, std::vector<std::string>& lines) {
  constexpr double kMuch = 0.2;
  const std::optional<double> not_followed = not_followed_fraction(summary);
  if (!not_followed || (*not_followed < kMuch && summary.mostly_not_followed == 0)) return;
  lines.push_back(fmt::format(
      "the optical flow does not follow {:.0f} % of the pixels that change between frames (between {} of {} "
      "pairs of frames, less than half of them): their motion is too large or too complex; use a video with "
      "more frames per second",
      100 * *not_followed, summary.mostly_not_followed, summary.frames - 1));
}

}  // namespace

std::vector<std::string> warnings_of_filters(const EventCameraOptions& sensor) {
  std::vector<std::string> lines = missing_blocks(sensor.filters, sensor.preset.name());
  for (std::string& line : lines) line = "event_camera.filters." + line;
  return lines;
}

std::vector<FilteredCamera> filtered_cameras(const Summary& summary) {
  std::vector<FilteredCamera> cameras;
  for (const CameraSummary& camera : summary.cameras) {
    for (const SensorSummary& sensor : camera.sensors) add_filtered(sensor.name, sensor.statistics, cameras);
  }
  return cameras;
}

std::vector<FilteredCamera> filtered_cameras(const ConversionSummary& summary) {
  std::vector<FilteredCamera> cameras;
  add_filtered(kConversionCamera, summary.sensor, cameras);
  return cameras;
}

std::vector<std::string> losses(const Scenario& scenario, const Summary& summary) {
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < summary.cameras.size(); ++i) {
    const CameraSummary& done = summary.cameras[i];
    const CameraOptions& camera = scenario.cameras[i];
    const std::string name = done.name + ": ";
    for (std::size_t k = 0; k < done.sensors.size(); ++k)
      add_sensor(done.sensors[k].name + ": ", camera.sensors()[k].readout, done.sensors[k].statistics, lines);
    add_sampling(name, scenario, camera, done.sampling, lines);
  }
  return lines;
}

void warn_of_noise(const std::string& name, const EventCameraOptions& options, const Notices& notices) {
  const std::optional<NoiseEstimate> noise = excessive_noise(options);
  if (!noise) return;
  notices.warning(fmt::format(
      "{}event_camera: the contrast threshold, {:.3g}, is below twice the noise of the circuit, {:.3g} in the dark: "
      "expect up to {:.0f} noise events per second of each pixel (at irradiance {:.2g}). Raise contrast_threshold",
      name, noise->threshold, noise->deviation, noise->rate_hz, noise->irradiance));
}

std::vector<std::string> hints(const Scenario& scenario, const Summary& summary) {
  const double simulated_s = to_seconds(summary.end - summary.start);
  const bool adaptive = std::ranges::any_of(scenario.cameras, [](const CameraOptions& camera) {
    return std::holds_alternative<AdaptiveSampling>(camera.sampling);
  });
  if (!adaptive || !std::holds_alternative<MeshRendererOptions>(scenario.renderer)) return {};
  if (summary.wall_seconds < simulated_s || summary.seconds.render < 0.5 * summary.wall_seconds) return {};
  return {
      fmt::format("rendering took {:.3g} of {:.3g} s. If edges of objects fill the image, flow sampling "
                  "(sampling={{type: flow}}) is "
                  "often several times faster than adaptive sampling",
                  summary.seconds.render, summary.wall_seconds)};
}

std::vector<std::string> losses(const ConversionOptions& options, const ConversionSummary& summary) {
  std::vector<std::string> lines;
  add_sensor("", options.event_camera.readout, summary.sensor, lines);
  add_motion(summary, lines);
  return lines;
}

}  // namespace esim::inline compose
