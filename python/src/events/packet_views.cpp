#include "events/packet_views.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>

namespace esim::python {
namespace {

/// `values` as `leading` x ... arrays of height x width.
template <typename T>
nb::object images(std::vector<T> values, const Camera& model) {
  const auto height = static_cast<std::size_t>(model.height), width = static_cast<std::size_t>(model.width);
  const std::size_t count = values.size() / std::max<std::size_t>(height * width, 1);
  return to_numpy(std::move(values), {count, height, width});
}

/// The same for pairs of images.
nb::object image_pairs(std::vector<float> values, const Camera& model) {
  const auto height = static_cast<std::size_t>(model.height), width = static_cast<std::size_t>(model.width);
  const std::size_t count = values.size() / std::max<std::size_t>(2 * height * width, 1);
  return to_numpy(std::move(values), {count, 2, height, width});
}

nb::dict to_dict(CameraPart part, const Camera& model) {
  nb::dict view;
  const std::size_t frames = part.t.size(), points = part.event_points.size() / 3;
  view["events"] = bytes_to_numpy(std::move(part.events));
  view["labels"] = bytes_to_numpy(std::move(part.labels));
  view["event_points"] = to_numpy(std::move(part.event_points), {points, 3});
  view["t"] = to_numpy(std::move(part.t));
  view["pose"] = to_numpy(std::move(part.poses), {frames, 4, 4});
  view["irradiance"] = images(std::move(part.irradiance), model);
  view["depth"] = images(std::move(part.depth), model);
  view["motion_field"] = image_pairs(std::move(part.motion_field), model);
  view["object"] = images(std::move(part.object), model);
  const std::size_t optical_flows = part.optical_flow_span.size() / 2;
  view["optical_flow_span"] = to_numpy(std::move(part.optical_flow_span), {optical_flows, 2});
  view["optical_flow"] = image_pairs(std::move(part.optical_flow), model);
  view["visible"] = images(std::move(part.visible), model);
  view["image_t"] = to_numpy(std::move(part.image_t));
  view["exposure_start"] = to_numpy(std::move(part.exposure_start));
  view["exposure"] = to_numpy(std::move(part.exposure));
  view["trigger_t"] = to_numpy(std::move(part.trigger_t));
  view["trigger_kind"] = to_numpy(std::move(part.trigger_kind));
  if (part.image_bits > 8) {
    view["images"] = images(std::move(part.images), model);
  } else {
    view["images"] = images(std::vector<std::uint8_t>(part.images.begin(), part.images.end()), model);
  }
  return view;
}

const CameraInfo& lens_of(const CameraInfo& sensor, const RecordingInfo& info) {
  return info.cameras[static_cast<std::size_t>(sensor.lens)];
}

/// The name of an event sensor that shares a lens, within its camera.
std::string name_of_sensor(const CameraInfo& sensor, const RecordingInfo& info) {
  return sensor.name.substr(lens_of(sensor, info).name.size() + 1);
}

nb::object matrix(const SE3& pose) {
  std::vector<double> values;
  append_matrix(pose, values);
  return to_numpy(std::move(values), {4, 4});
}

}  // namespace

nb::dict to_dict(Packet packet, const RecordingInfo& info) {
  nb::dict view, cameras;
  view["t0"] = packet.t0;
  view["t1"] = packet.t1;
  for (std::size_t i = 0; i < packet.cameras.size(); ++i) {
    const CameraInfo& camera = info.cameras[i];
    nb::dict part = to_dict(std::move(packet.cameras[i]), camera.model);
    part["sensors"] = nb::dict();
    if (camera.lens < 0) {
      cameras[camera.name.c_str()] = part;
    } else {
      cameras[lens_of(camera, info).name.c_str()]["sensors"][name_of_sensor(camera, info).c_str()] = part;
    }
  }
  view["cameras"] = cameras;
  const std::size_t states = packet.body.size();
  view["body"] = bytes_to_numpy(std::move(packet.body));
  view["objects"] = to_numpy(std::move(packet.objects), {states, info.objects.size(), 4, 4});
  view["imu"] = bytes_to_numpy(std::move(packet.imu));
  return view;
}

nb::dict to_dict(const RecordingInfo& info) {
  nb::dict view, cameras;
  for (const CameraInfo& camera : info.cameras) {
    if (camera.lens >= 0) {
      nb::cast<nb::list>(cameras[lens_of(camera, info).name.c_str()]["sensors"]).append(name_of_sensor(camera, info));
      continue;
    }
    nb::dict one;
    one["sensors"] = nb::list();
    const Camera& model = camera.model;
    one["width"] = model.width;
    one["height"] = model.height;
    one["K"] = to_numpy(std::vector<double>{model.fx, 0, model.cx, 0, model.fy, model.cy, 0, 0, 1}, {3, 3});
    one["T_body_camera"] = matrix(camera.T_body_camera);
    cameras[camera.name.c_str()] = one;
  }
  view["start"] = info.start;
  view["end"] = info.end;
  view["cameras"] = cameras;
  view["objects"] = nb::cast(info.objects);
  return view;
}

}  // namespace esim::python
