#pragma once

#include <nanobind/nanobind.h>

/// Each file adds its part to the module. The public interface is written in Python on top of it.
namespace esim::python {

void bind_errors(nanobind::module_& module);
void bind_scenario(nanobind::module_& module);
void bind_trajectory(nanobind::module_& module);
void bind_event_camera(nanobind::module_& module);
void bind_sensor(nanobind::module_& module);
void bind_simulation(nanobind::module_& module);
void bind_event_files(nanobind::module_& module);
void bind_recording_files(nanobind::module_& module);
void bind_filters(nanobind::module_& module);
void bind_representations(nanobind::module_& module);
void bind_pictures(nanobind::module_& module);
void bind_dataset(nanobind::module_& module);
void bind_video(nanobind::module_& module);

}  // namespace esim::python
