#include "esim/compose/samples/sensor_preview.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "esim/compose/samples/changed_sensors.h"
#include "esim/compose/samples/stored_samples.h"
#include "esim/core/error.h"

namespace esim::inline compose {
namespace {

/// Events before the requested ones are forgotten beyond this number.
constexpr std::size_t kMaxKept = std::size_t{1} << 24;

/// Keeps events.
class EventList final : public Sink {
 public:
  void begin(const RecordingInfo&) override {}
  void write(const Record& record) override {
    const auto* const packet = std::get_if<EventsRecord>(&record);
    if (packet != nullptr) events.insert(events.end(), packet->events.begin(), packet->events.end());
  }
  void end(bool) override {}

  std::vector<Event> events;
};

/// The number of the camera whose sensor is recorded under a name.
std::size_t camera_of(const Scenario& scenario, const std::string& name) {
  const std::string camera = name.substr(0, name.find('/'));
  const auto found = std::ranges::find(scenario.cameras, camera, &CameraOptions::name);
  if (found == scenario.cameras.end() || !found->events)
    throw UserError(fmt::format("{}: scenario.yaml has no such event camera", name));
  return static_cast<std::size_t>(found - scenario.cameras.begin());
}

/// The scenario with only one event sensor, without labels.
Scenario alone(Scenario scenario, std::size_t camera, const std::string& name) {
  for (CameraOptions& other : scenario.cameras) other.events = false;
  CameraOptions& only = scenario.cameras[camera];
  only.events = true;
  if (!only.event_cameras.empty()) {
    const std::size_t slash = name.find('/');
    const auto found = std::ranges::find(only.event_cameras, slash == std::string::npos ? "" : name.substr(slash + 1),
                                         &SensorOptions::name);
    if (found == only.event_cameras.end())
      throw UserError(fmt::format("{}: scenario.yaml has no such event sensor", name));
    only.event_cameras = {*found};
  }
  only.event_camera.labels = false;
  for (SensorOptions& sensor : only.event_cameras) sensor.labels = false;
  return scenario;
}

}  // namespace

struct SensorPreview::Impl {
  explicit Impl(SensorPreviewOptions given)
      : options(std::move(given)),
        sensors(change_sensors(options.recording, options.overrides, "", options.refuses)),
        camera(camera_of(sensors.changed, options.camera)),
        scenario(alone(sensors_only(sensors.changed), camera, options.camera)) {
    samples = open_samples(sensors, camera, false).info();
    inexact = inexact_because(sensors, {samples});
    start_at(samples.start);  // checks all options
  }

  const SensorOptions& sensor() const { return scenario.cameras[camera].first_sensor(); }

  void start_at(TimeNs t) {
    const Notices quiet{[](const std::string&) {}, [](const std::string&) {}};
    simulator.reset();
    list.events.clear();
    world = build_sensors(scenario, samples, options.threads, quiet);
    for (std::size_t i = 0; i < world->cameras.size(); ++i) {
      world->cameras[i].sampler =
          i == camera ? make_stored_sampler(open_samples(sensors, i, world->workers->threads() > 1), *world->workers, t)
                      : make_no_sampler(world->info.end);
    }
    begin = done = t;
    simulator.emplace(*world, list);
  }

  /// Simulates until all events until `t` are known; false if `goes_on` returned false before.
  bool advance_beyond(TimeNs t, const std::function<bool()>& goes_on) {
    if (done > t || done == samples.end) return true;
    bool stopped = false;
    const auto monitor = [&](const Progress&) {
      done = world->cameras[camera].sampler->watermark();
      stopped = !goes_on();
      return !stopped && done <= t;
    };
    if (simulator->advance_until(samples.end, monitor)) {  // all samples
      simulator->finish();
      done = samples.end;
    }
    return !stopped;
  }

  SensorPreviewOptions options;
  ChangedSensors sensors;
  std::size_t camera;
  Scenario scenario;  // of this sensor
  SampleStoreInfo samples;
  std::string inexact;

  std::optional<World> world;
  EventList list;                      // from `begin` on
  std::optional<Simulator> simulator;  // of the world
  TimeNs begin = 0, done = 0;          // of the part that has been simulated
};

SensorPreview::SensorPreview(SensorPreviewOptions options) : impl_(std::make_unique<Impl>(std::move(options))) {}
SensorPreview::~SensorPreview() = default;

const Scenario& SensorPreview::scenario() const { return impl_->scenario; }
const std::string& SensorPreview::inexact() const { return impl_->inexact; }

std::vector<Event> SensorPreview::events(TimeNs from, TimeNs to, const std::function<bool()>& goes_on) {
  Impl& impl = *impl_;
  const TimeNs warm_up = impl.sensor().circuit ? kCircuitWarmUp : kWarmUp;
  const TimeNs begin = std::clamp(from - warm_up, impl.samples.start, impl.samples.end);
  if (begin < impl.begin || begin > impl.done + warm_up) impl.start_at(begin);
  if (!impl.advance_beyond(std::min(to, impl.samples.end), goes_on)) return {};
  std::vector<Event>& all = impl.list.events;
  const auto first = std::ranges::lower_bound(all, from, {}, &Event::t);
  std::vector<Event> found(first, std::ranges::upper_bound(first, all.end(), to, {}, &Event::t));
  if (all.size() > kMaxKept) {
    all.erase(all.begin(), first);
    impl.begin = from;
  }
  return found;
}

}  // namespace esim::inline compose
