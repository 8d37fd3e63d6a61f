#include "esim/sensors/event_camera_options.h"

namespace esim {

EventCameraOptions preset_options(SensorPreset preset) {
  EventCameraOptions o;
  o.preset = preset;
  return o;
}

}  // namespace esim
