#include <algorithm>
#include <nlohmann/json.hpp>
#include <span>

#include "esim/compose/compose.h"

namespace esim::inline compose {
namespace {

using Json = nlohmann::ordered_json;

Json json(const MeasuredError& error) { return {{"mean", error.mean}, {"p99", error.p99}, {"max", error.max}}; }
void add_filtered(const std::vector<FilteredCamera>& cameras, Json& report) {
  if (!cameras.empty()) report["filtered"] = Json::parse(to_json(cameras));
}

Json json(const HashedFile& input) {
  const UsedFile& file = input.file;
  Json result = {{"file", file.path.string()}};
  if (file.regular) result["bytes"] = file.bytes;
  result["sha256"] = file.sha256.empty() ? Json(nullptr) : Json(file.sha256);
  if (!input.problem.empty()) result["problem"] = input.problem;
  return result;
}

void add_provenance(const Provenance& provenance, Json& report) {
  const Repetition& repetition = provenance.repetition;
  report["command"] = repetition.command.empty() ? Json(nullptr) : Json(repetition.command);
  if (!repetition.obstacle.empty()) report["no_command_because"] = repetition.obstacle;
  report["working_folder"] = provenance.working_folder.string();
  report["inputs"] = Json::array();
  for (const HashedFile& input : provenance.inputs) report["inputs"].push_back(json(input));
}

/// The events of a sensor, or of several.
Json json(const SensorSummary& sensor, double simulated_s) {
  const std::int64_t events = sensor.events_on + sensor.events_off;
  return {{"events", events},
          {"events_on", sensor.events_on},
          {"events_off", sensor.events_off},
          {"events_dropped_by_readout", sensor.statistics.dropped},
          {"events_delayed_by_readout", sensor.statistics.delayed},
          {"longest_readout_delay_s", to_seconds(sensor.statistics.longest_delay)},
          {"events_lost_by_max_rate", sensor.statistics.lost},
          {"events_per_second", simulated_s > 0 ? static_cast<double>(events) / simulated_s : 0.0}};
}

/// The events of all sensors of a camera; the longest delay of any.
SensorSummary sum_of(const std::vector<SensorSummary>& sensors) {
  SensorSummary sum;
  for (const SensorSummary& sensor : sensors) {
    sum.events_on += sensor.events_on;
    sum.events_off += sensor.events_off;
    sum.statistics.dropped += sensor.statistics.dropped;
    sum.statistics.delayed += sensor.statistics.delayed;
    sum.statistics.longest_delay = std::max(sum.statistics.longest_delay, sensor.statistics.longest_delay);
    sum.statistics.lost += sensor.statistics.lost;
  }
  return sum;
}

/// One of several sensors: its name, what distinguishes it, and its events.
Json json(const SensorOptions& sensor, const Scenario& scenario, const SensorSummary& summary, double simulated_s) {
  Json result = {{"name", sensor.name},
                 {"folder", summary.name},
                 {"preset", sensor.preset.name()},
                 {"contrast_threshold_on", sensor.threshold_on()},
                 {"contrast_threshold_off", sensor.threshold_off()},
                 {"seed", sensor.seed.value_or(scenario.seed)}};
  for (const SensorOptions::Varied& option : sensor.varied) result["varied"][option.key] = option.value;
  result.update(json(summary, simulated_s));
  return result;
}

Json json(const EngineImages& images) {
  return {{"rendered", images.rendered}, {"from_cache", images.from_cache}, {"cache", images.cache}};
}

Json json(double number) { return number; }
Json json(std::int64_t number) { return number; }

}  // namespace

std::string report_json(const Scenario& scenario, const Summary& summary, int threads,
                        const std::vector<std::string>& notices, const std::optional<Provenance>& provenance) {
  const double simulated_s = to_seconds(summary.end - summary.start);

  Json cameras = Json::array();
  for (std::size_t i = 0; i < summary.cameras.size(); ++i) {
    const CameraSummary& camera = summary.cameras[i];
    const SamplingStatistics& sampling = camera.sampling;
    const double pixels = static_cast<double>(camera.width * camera.height);
    cameras.push_back({
        {"name", camera.name},
        {"renderer", camera.renderer},
        {"width", camera.width},
        {"height", camera.height},
        {"sampling", std::visit([](const auto& criterion) { return criterion.kType; }, scenario.cameras[i].sampling)},
        {"frames", sampling.samples},
        {"pixel_evaluations", sampling.pixel_evaluations},
        {"frame_equivalents", static_cast<double>(sampling.pixel_evaluations) / pixels},
        {"samples_held_to_max_rate", sampling.held_to_max_rate},
    });
    cameras.back().update(json(sum_of(camera.sensors), simulated_s));
    const std::span<const SensorOptions> sensors = scenario.cameras[i].sensors();
    if (sensors.size() == 1) cameras.back()["preset"] = sensors.front().preset.name();
    for (std::size_t k = 0; k < sensors.size(); ++k) {
      if (!sensors[k].name.empty())
        cameras.back()["sensors"].push_back(json(sensors[k], scenario, camera.sensors[k], simulated_s));
    }
    if (scenario.cameras[i].frame_camera) cameras.back()["frames_written"] = camera.frames;
    if (sampling.measured_error) {
      cameras.back()["tolerance"] = sampling.tolerance;
      cameras.back()["measured_error"] = json(*sampling.measured_error);
      cameras.back()["bisections"] = sampling.bisections;
      cameras.back()["audits"] = sampling.audits;
      cameras.back()["reconstructions"] = 0;  // methods that reconstruct images replace these two
      cameras.back()["unseen_fraction"] = 0.0;
    }
    for (const auto& [name, value] : sampling.others)
      cameras.back()[name] = std::visit([](const auto& result) { return json(result); }, value);
  }

  const StageSeconds& s = summary.seconds;
  const double other = summary.wall_seconds - (s.render + s.sampling + s.events + s.frames + s.truth + s.write);
  Json report = {
      {"status", summary.complete ? "complete" : "interrupted"},
      {"esim_version", ESIM_VERSION},
      {"esim_commit", source_commit()},
      {"seed", scenario.seed},
      {"start_s", to_seconds(summary.start)},
      {"simulated_s", simulated_s},
      {"wall_s", summary.wall_seconds},
      {"real_time_factor", summary.wall_seconds > 0 ? simulated_s / summary.wall_seconds : 0.0},
      {"threads", threads},
      {"wall_s_by_stage",
       {{"render", s.render},
        {"sampling", s.sampling},
        {"events", s.events},
        {"frames", s.frames},
        {"truth", s.truth},
        {"write", s.write},
        {"other", other}}},
      {"truth_frames", summary.truth_frames},
      {"imu_samples", summary.imu_samples},
      {"cameras", cameras},
      {"notices", notices},
  };
  if (summary.engine_images) report["engine_images"] = json(*summary.engine_images);
  add_filtered(filtered_cameras(summary), report);
  if (!summary.problem.empty()) report["reason"] = summary.problem;
  if (provenance) add_provenance(*provenance, report);
  return report.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string report_json(const ConversionOptions& options, const ConversionSummary& summary, int threads,
                        const std::vector<std::string>& notices, const std::optional<Provenance>& provenance) {
  const double converted_s = to_seconds(summary.end - summary.start);
  const std::int64_t events = summary.events_on + summary.events_off;
  const std::optional<double> not_followed = not_followed_fraction(summary);
  const ConversionSummary::Seconds& s = summary.seconds;
  const double other = summary.wall_seconds - (s.decode + s.motion + s.interpolation + s.events + s.write);
  Json report = {
      {"status", summary.complete ? "complete" : "interrupted"},
      {"esim_version", ESIM_VERSION},
      {"esim_commit", source_commit()},
      {"input", options.input.string()},
      {"seed", options.seed},
      {"start_s", to_seconds(summary.start)},
      {"simulated_s", converted_s},
      {"wall_s", summary.wall_seconds},
      {"real_time_factor", summary.wall_seconds > 0 ? converted_s / summary.wall_seconds : 0.0},
      {"threads", threads},
      {"wall_s_by_stage",
       {{"decode", s.decode},
        {"motion", s.motion},
        {"interpolation", s.interpolation},
        {"events", s.events},
        {"write", s.write},
        {"other", other}}},
      {"width", summary.width},
      {"height", summary.height},
      {"preset", options.event_camera.preset.name()},
      {"frames", summary.frames},
      {"steps", summary.steps},
      {"intervals_held_to_max_steps", summary.held},
      {"max_optical_flow_px", summary.max_optical_flow_px},
      {"changed_pixels_not_followed", not_followed ? Json(*not_followed) : Json(nullptr)},
      {"intervals_mostly_not_followed", summary.mostly_not_followed},
      {"interpolator", options.interpolator.empty() ? Json(nullptr) : Json(options.interpolator)},
      {"events", events},
      {"events_on", summary.events_on},
      {"events_off", summary.events_off},
      {"events_dropped_by_readout", summary.sensor.dropped},
      {"events_delayed_by_readout", summary.sensor.delayed},
      {"longest_readout_delay_s", to_seconds(summary.sensor.longest_delay)},
      {"events_lost_by_max_rate", summary.sensor.lost},
      {"events_per_second", converted_s > 0 ? static_cast<double>(events) / converted_s : 0.0},
      {"modulation_between_frames_rms", summary.modulation ? Json(*summary.modulation) : Json(nullptr)},
      {"notices", notices},
  };
  add_filtered(filtered_cameras(summary), report);
  if (!summary.problem.empty()) report["reason"] = summary.problem;
  if (provenance) add_provenance(*provenance, report);
  return report.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace esim::inline compose
