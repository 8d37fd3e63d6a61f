#include "simulation/scenario.h"

#include <fmt/format.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "bindings.h"
#include "esim/scenario/read.h"

namespace esim::python {

namespace nb = nanobind;

namespace {

/// A short description: "cam0 240 x 180 px, 2 s".
std::string describe(const Scenario& scenario) {
  std::string text;
  for (const CameraOptions& camera : scenario.cameras) {
    const auto size = camera_model(camera);
    text += fmt::format("{}{} {} x {} px", text.empty() ? "" : ", ", camera.name, size.width, size.height);
  }
  return scenario.duration_s ? fmt::format("{}, {:g} s", text, *scenario.duration_s) : text;
}

}  // namespace

void bind_scenario(nb::module_& module) {
  nb::class_<CheckedScenario>(module, "Scenario")
      .def(
          "__init__",
          [](CheckedScenario* self, const std::string& yaml, const std::filesystem::path& file, bool has_lines,
             const std::vector<std::string>& overrides, bool needs_renderer, bool needs_trajectory) {
            ScenarioText text;
            text.yaml = yaml;
            text.file = file;
            text.has_lines = has_lines;
            text.overrides = overrides;
            text.setter = "";
            text.needs_renderer = needs_renderer;
            text.needs_trajectory = needs_trajectory;
            new (self) CheckedScenario{read_scenario(text)};
          },
          nb::arg("yaml"), nb::arg("file"), nb::arg("has_lines"), nb::arg("overrides"), nb::arg("needs_renderer"),
          nb::arg("needs_trajectory"))
      .def("describe", [](const CheckedScenario& self) { return describe(self.value); })
      .def("to_yaml", [](const CheckedScenario& self) { return write_scenario(self.value); });
  module.def("scenario_reference", &scenario_reference);
}

}  // namespace esim::python
