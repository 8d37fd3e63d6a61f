#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "esim/compose/compose.h"
#include "esim/sample_store/sample_store.h"
#include "esim/scenario/scenario.h"

// Private to compose.
namespace esim::inline compose {

/// A recording with samples whose event sensors have other options.
struct ChangedSensors {
  std::filesystem::path recording;
  Scenario recorded, changed;
};

/// Applies overrides ("key=value"), which may change the event sensors, the light's unit and the output. Those of
/// `event_camera` apply to all sensors of all cameras, and a preset replaces all their options. `setter`: the beginning
/// of messages about them. `refuses`: as in ScenarioText; if set, the scenario's renderer and trajectory are not read.
/// Throws UserError for other overrides, and if the folder is not a recording.
ChangedSensors change_sensors(const std::filesystem::path& recording, const std::vector<std::string>& overrides,
                              const std::string& setter,
                              const std::function<std::string(const std::filesystem::path&)>& refuses = {});

/// The samples of a camera of the recording, checked against its options. `read_ahead`: as of SampleStoreReader.
SampleStoreReader open_samples(const ChangedSensors& sensors, std::size_t camera, bool read_ahead);

/// Why the events are not those of a simulation with the changed sensors; empty if they are.
std::string inexact_because(const ChangedSensors& sensors, const std::vector<SampleStoreInfo>& stores);

/// What remains of a scenario without its scene: the sensors. The segments contain light, colour filters and motion.
Scenario sensors_only(const Scenario& scenario);

/// A world of such a scenario, in which nothing moves and nothing is rendered. Its samplers are for the caller to set.
World build_sensors(const Scenario& sensors, const SampleStoreInfo& samples, int threads, const Notices& notices);

}  // namespace esim::inline compose
