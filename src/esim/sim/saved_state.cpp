#include "esim/sim/saved_state.h"

#include "esim/core/state_archive.h"

namespace esim::inline sim {
namespace {

/// Of a summary, what is not computed at the end.
template <class Archive, class Summary>
void transfer_summary(Archive& archive, Summary& summary) {
  archive.value(summary.end);
  archive.value(summary.truth_frames);
  archive.value(summary.imu_samples);
  archive.value(summary.seconds);
  archive.value(summary.wall_seconds);
  for (auto& camera : summary.cameras) {
    archive.value(camera.frames);
    for (auto& sensor : camera.sensors) {
      archive.value(sensor.events_on);
      archive.value(sensor.events_off);
    }
  }
}

void transfer_events(StateWriter& archive, const EventCamera& camera) { archive.list(camera.state()); }
void transfer_events(StateReader& archive, EventCamera& camera) {
  std::vector<std::byte> state;
  archive.list(state);
  camera.restore(state);
}

void transfer_flow(StateWriter& archive, const OpticalFlowFromDepth& flow, const World&, std::size_t) {
  flow.save(archive);
}
void transfer_flow(StateReader& archive, OpticalFlowFromDepth& flow, const World& world, std::size_t camera) {
  flow.restore(archive, [&](TimeNs t) { return view(world, camera, t); });
}

/// The variable state of a world, and of the summary of its simulation.
template <class Archive, class Summary>
void transfer(Archive& archive, World& world, Summary& summary) {
  transfer_summary(archive, summary);
  archive.value(world.truth_clock);
  archive.value(world.pose_clock);
  if (world.imu) archive.value(world.imu->clock);
  for (std::size_t i = 0; i < world.cameras.size(); ++i) {
    CameraChannel& camera = world.cameras[i];
    archive.object(*camera.sampler);
    for (EventSensor& sensor : camera.event_sensors) {
      transfer_events(archive, sensor.event_camera);
      if (sensor.flicker_labels) FlickerLabels::transfer(archive, *sensor.flicker_labels);
    }
    if (camera.frame_camera) archive.object(*camera.frame_camera);
    if (camera.flicker) Flicker::transfer(archive, *camera.flicker);
    if (camera.optical_flow) transfer_flow(archive, *camera.optical_flow, world, i);
    if (camera.seen_objects) SeenObjects::transfer(archive, *camera.seen_objects);
  }
}

}  // namespace

std::vector<std::byte> save_state(World& world, const Summary& summary) {
  std::vector<std::byte> bytes;
  StateWriter archive(bytes);
  transfer(archive, world, summary);
  return bytes;
}

void restore_state(std::span<const std::byte> state, World& world, Summary& summary) {
  StateReader archive(state);
  transfer(archive, world, summary);
  if (!archive.at_end()) StateReader::fail();
}

}  // namespace esim::inline sim
