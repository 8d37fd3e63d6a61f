#include <fmt/format.h>

#include <algorithm>

#include "esim/compose/compose.h"
#include "esim/compose/samples/changed_sensors.h"
#include "esim/compose/samples/samples_file.h"
#include "esim/compose/samples/stored_samples.h"
#include "esim/core/error.h"
#include "esim/files/output_file.h"
#include "esim/recording/keep_on_failure.h"
#include "esim/recording/recording_directory.h"

namespace esim::inline compose {
namespace {

namespace fs = std::filesystem;

/// The stores of the cameras with sensors.
std::vector<SampleStoreReader> open_stores(const ChangedSensors& sensors, bool read_ahead) {
  const std::vector<CameraOptions>& cameras = sensors.changed.cameras;
  std::vector<SampleStoreReader> stores;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (!cameras[i].events) continue;
    const SampleStoreInfo& info = stores.emplace_back(open_samples(sensors, i, read_ahead)).info();
    if (info.start != stores.front().info().start || info.end != stores.front().info().end) {
      throw UserError(fmt::format("{}: covers another time than that of camera {}; simulate again",
                                  (sensors.recording / cameras[i].name / kSamplesFile).string(), cameras.front().name));
    }
  }
  if (stores.empty()) throw UserError(fmt::format("{}: no camera has an event sensor", sensors.recording.string()));
  return stores;
}

/// The threads for the pixels. Pixels of a single sensor without a circuit are so fast that reading the samples and
/// writing the events keep another thread busy.
int pixel_threads(const Scenario& scenario, int threads) {
  std::size_t sensors = 0;
  bool circuit = false;
  for (const CameraOptions& camera : scenario.cameras) {
    for (const SensorOptions& sensor : camera.sensors()) ++sensors, circuit |= sensor.circuit.has_value();
  }
  return sensors == 1 && !circuit ? std::max(1, threads - 1) : threads;
}

/// Refuses labels that need what the samples do not contain.
void check_labels(const ChangedSensors& sensors) {
  const auto& [recording, recorded, changed] = sensors;
  const bool labels = std::ranges::any_of(changed.cameras, [](const CameraOptions& camera) {
    return std::ranges::any_of(camera.sensors(), &SensorOptions::labels);
  });
  if (!labels) return;
  std::error_code error;
  const bool moves =
      fs::exists(recording / "objects", error) || std::holds_alternative<SpritesRendererOptions>(recorded.renderer);
  if (moves || flickers(recorded)) {
    throw UserError(
        "event_camera.labels: the samples contain neither the objects that the pixels saw nor the flicker of the "
        "light; remove it, or simulate again");
  }
}

}  // namespace

Resensed resense(const ResenseOptions& options, const Notices& notify, const Monitor& monitor) {
  std::vector<std::string> given;
  const Notices notices = keeping(notify, given);
  const ChangedSensors change = change_sensors(options.recording, options.overrides, options.setter);
  const Scenario& changed = change.changed;
  const int threads = Workers(options.threads).threads();
  std::vector<SampleStoreReader> stores = open_stores(change, threads > 1);
  check_labels(change);
  std::error_code error;
  if (fs::equivalent(options.recording, options.out, error))
    throw UserError(fmt::format("{}: is the recording with the samples; choose another folder", options.out.string()));
  RecordingDirectory directory(options.out, options.replace);
  ProvenanceRecorder provenance(options.repetition);
  provenance.add(changed.files);

  std::vector<SampleStoreInfo> infos;
  for (const SampleStoreReader& store : stores) infos.push_back(store.info());
  notices.note(fmt::format("events of the samples in {}", options.recording.string()));
  Resensed result;
  const std::string reason = inexact_because(change, infos);
  result.exact = reason.empty();
  (result.exact ? notices.note : notices.warning)(
      result.exact
          ? "the events are exactly those of a simulation with these sensors"
          : fmt::format("the events differ slightly from those of a simulation with these sensors: {}", reason));

  const Scenario sensors = sensors_only(changed);
  World world = build_sensors(sensors, infos.front(), pixel_threads(sensors, threads), notices);
  auto store = stores.begin();
  for (std::size_t i = 0; i < world.cameras.size(); ++i) {
    world.cameras[i].sampler = sensors.cameras[i].events ? make_stored_sampler(std::move(*store++), *world.workers)
                                                         : make_no_sampler(world.info.end);
  }
  write_file_atomically(directory.path() / "scenario.yaml", write_scenario(changed));
  const std::unique_ptr<Sink> sink = build_sink(sensors, directory.path());
  bool anything = false;
  keep_on_failure(directory, anything, [&]() -> std::optional<Summary> {
    result.summary = simulate(world, *sink, [&](const Progress& progress) {
      anything |= progress.now > progress.start;
      return monitor(progress);
    });
    for (const std::string& loss : losses(sensors, result.summary)) given.push_back("warning: " + loss);
    directory.finish(report_json(changed, result.summary, threads, given, provenance.finish(result.summary.complete)));
    return result.summary;
  });
  return result;
}

}  // namespace esim::inline compose
