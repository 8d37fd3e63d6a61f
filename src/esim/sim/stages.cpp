#include "esim/sim/stages.h"

#include <algorithm>
#include <limits>

#include "esim/sim/stopwatch.h"

namespace esim::inline sim {

void Stages::start_rendering(CameraChannel& camera, TimeNs known_until) {
  timed(seconds_.render, [&] {
    const SampleRequest* const next = camera.sampler->next();
    if (next == nullptr || next->last() > known_until) return camera.rendering.reset();
    const auto index = static_cast<std::size_t>(&camera - world_.cameras.data());
    std::vector<RenderRequest> views = {view(world_, index, next->t, next->tiles)};
    for (const auto& [t, tiles] : next->later) views.push_back(view(world_, index, t, tiles));
    for (RenderRequest& view : views) {
      view.motion_rows = next->motion_rows;
      view.which_objects = camera.seen_objects.has_value();
    }
    Renderer& renderer = next->renderer != nullptr ? *next->renderer : *camera.renderer;
    camera.rendering = renderer.start_together(std::move(views));
  });
}

void Stages::finish_rendering(CameraChannel& camera) {
  timed(seconds_.render, [&] { camera.rendering->finish(camera.sample); });
  if (!camera.seen_objects) return;
  timed(seconds_.truth, [&] {
    const SampleRequest& request = *camera.sampler->next();
    camera.seen_objects->add(camera.sample.object, request.t, request.tiles);
    for (const auto& [t, tiles] : request.later) camera.seen_objects->add(camera.sample.object, t, tiles);
  });
}

std::span<const Segment> Stages::accept_sample(CameraChannel& camera) {
  return timed(seconds_.sampling, [&] { return camera.sampler->accept(camera.sample); });
}

std::span<const Segment> Stages::more_segments(CameraChannel& camera) {
  return timed(seconds_.sampling, [&] { return camera.sampler->more(); });
}

void Stages::look_at_lights(CameraChannel& camera, std::span<const Segment> segments) {
  if (!camera.flicker) return;
  timed(seconds_.sampling, [&] {
    const auto index = static_cast<std::size_t>(&camera - world_.cameras.data());
    const Camera& model = world_.info.cameras[index].model;
    camera.flicker->look(segments, model.width, model.height, [&](TimeNs t, const Tile& tile, Sample& sample) {
      RenderRequest request = view(world_, index, t, {tile});
      request.which_objects = true;
      camera.renderer->render(std::move(request), sample);
    });
  });
}

template <typename Work>
void Stages::for_each_sensor(CameraChannel& camera, const Work& work) {
  std::vector<EventSensor>& sensors = camera.event_sensors;
  const Workers& workers = *world_.workers;
  if (static_cast<int>(sensors.size()) < workers.threads()) {
    for (EventSensor& sensor : sensors) work(sensor, workers);
  } else {
    workers.for_each(static_cast<int>(sensors.size()),
                     [&](int i) { work(sensors[static_cast<std::size_t>(i)], one_thread_); });
  }
}

void Stages::make_events(CameraChannel& camera, std::span<const Segment> segments) {
  if (camera.event_sensors.empty()) return;
  timed(seconds_.events, [&] {
    const auto integrate = [&](std::span<const Segment> some, TimeNs watermark) {
      for_each_sensor(camera, [&](EventSensor& sensor, const Workers& workers) {
        sensor.event_camera.integrate(some, watermark, workers);
      });
      if (camera.keep_samples) camera.keep_samples(some, watermark);
    };
    const TimeNs watermark = camera.sampler->watermark();
    if (!camera.flicker) return integrate(segments, watermark);
    camera.flicker->divide(watermark, *world_.workers, integrate);
  });
}

void Stages::release_events(CameraChannel& camera, TimeNs until) {
  if (camera.event_sensors.empty()) return;
  timed(seconds_.events, [&] {
    for_each_sensor(
        camera, [&](EventSensor& sensor, const Workers&) { sensor.events = sensor.event_camera.release_until(until); });
  });
}

void Stages::expose_frames(CameraChannel& camera, std::span<const Segment> segments) {
  if (!camera.frame_camera) return;
  timed(seconds_.frames, [&] {
    camera.frame_camera->integrate(segments, camera.sampler->watermark(), *world_.workers,
                                   camera.flicker ? &*camera.flicker : nullptr);
  });
}

const OpticalFlowImages* Stages::render_truth(CameraChannel& camera, const RenderRequest& request, Sample& truth) {
  return timed(seconds_.truth, [&]() -> const OpticalFlowImages* {
    camera.renderer->render(request, truth);
    if (camera.flicker) camera.flicker->illuminate(request.t, truth.object, truth.irradiance);
    return camera.optical_flow ? camera.optical_flow->advance(request, truth) : nullptr;
  });
}

void Stages::label_events(CameraChannel& camera, EventSensor& sensor, std::vector<EventLabel>& labels) {
  const LabelSpan made = sensor.event_camera.labels();
  labels.assign(made.begin(), made.end());
  if (labels.empty()) return;
  timed(seconds_.truth, [&] {
    if (camera.seen_objects) {
      for (std::size_t i = 0; i < labels.size(); ++i)
        labels[i].object = camera.seen_objects->at(sensor.events[i].x, sensor.events[i].y, labels[i].t_ideal);
    }
    if (sensor.flicker_labels) sensor.flicker_labels->set(*camera.flicker, sensor.events, labels);
  });
}

void Stages::forget_seen_objects(CameraChannel& camera) {
  if (!camera.seen_objects || !camera.seen_objects->is_long()) return;
  timed(seconds_.truth, [&] {
    TimeNs needed_from = std::numeric_limits<TimeNs>::max();
    for (const EventSensor& sensor : camera.event_sensors) {
      if (sensor.event_camera.has_labels()) needed_from = std::min(needed_from, sensor.event_camera.labels_from());
    }
    camera.seen_objects->forget_before(needed_from);
  });
}

void Stages::locate_events(CameraChannel& camera, std::span<const Event> events, std::vector<Eigen::Vector3f>& points) {
  timed(seconds_.truth, [&] { camera.event_points->locate(events, points); });
}

void Stages::write(Sink& out, const Record& record) {
  timed(seconds_.write, [&] { out.write(record); });
}

void Stages::end(Sink& out, bool complete) {
  timed(seconds_.write, [&] { out.end(complete); });
}

}  // namespace esim::inline sim
