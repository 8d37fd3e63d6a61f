#include "esim/scenario/conversion.h"

#include "esim/scenario/scenario.h"
#include "esim/scenario/yaml/yaml_reader.h"

namespace esim::inline scenario {
namespace {

struct EventCameraAlone {
  EventCameraOptions event_camera;
};

template <class Visitor>
void describe(Visitor& visit, EventCameraAlone& o) {
  visit("event_camera", o.event_camera, About{});
}

/// A camera's size and lens.
struct Geometry {
  CameraOptions options;
};

template <class Visitor>
void describe(Visitor& visit, Geometry& o) {
  describe_geometry(visit, o.options);
}

struct CameraAlone {
  Geometry camera;
};

template <class Visitor>
void describe(Visitor& visit, CameraAlone& o) {
  visit("camera", o.camera, About{});
}

}  // namespace

Camera read_camera(const std::vector<std::string>& overrides) {
  return camera_model(read_overrides<CameraAlone>(overrides, "").camera.options);
}

EventCameraOptions read_event_camera(const std::vector<std::string>& overrides, const std::string& setter) {
  const std::string prefix = "event_camera.";
  std::vector<std::string> prefixed;
  for (const std::string& text : overrides) prefixed.push_back(text.starts_with(prefix) ? text : prefix + text);
  return read_overrides<EventCameraAlone>(prefixed, setter).event_camera;
}

}  // namespace esim::inline scenario
