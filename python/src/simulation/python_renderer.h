#pragma once

#include <nanobind/nanobind.h>

#include <memory>

#include "esim/geometry/camera.h"
#include "esim/render/renderer.h"

namespace esim::python {

/// A Python function that threads may call and release without holding the GIL.
class PythonFunction {
 public:
  explicit PythonFunction(nanobind::object function);

  // Needs the GIL.
  const nanobind::object& get() const { return *function_; }
  void clear() { function_->reset(); }

 private:
  std::shared_ptr<nanobind::object> function_;
};

/// A renderer that calls Python for complete images: `render(t, T_world_camera, T_world_objects, shape)` returns
/// irradiance and depth, and optionally motion_field and object. _simulation/_simulate.py checks them.
std::unique_ptr<Renderer> make_python_renderer(const PythonFunction& render, const Camera& camera);

}  // namespace esim::python
