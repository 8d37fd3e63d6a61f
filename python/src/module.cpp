#include "bindings.h"

NB_MODULE(_core, module) {
  using namespace esim::python;
  module.attr("__version__") = ESIM_VERSION;
  bind_errors(module);
  bind_scenario(module);
  bind_trajectory(module);
  bind_event_camera(module);
  bind_sensor(module);
  bind_simulation(module);
  bind_event_files(module);
  bind_recording_files(module);
  bind_filters(module);
  bind_representations(module);
  bind_pictures(module);
  bind_dataset(module);
  bind_video(module);
}
