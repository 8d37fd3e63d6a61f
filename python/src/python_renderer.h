#pragma once

#include <nanobind/nanobind.h>

#include <memory>

#include "esim/geometry/camera.h"
#include "esim/render/renderer.h"

namespace esim::python {

/// A function of Python's that is called, and let go, by threads that need not hold Python's lock.
class PythonFunction {
 public:
  explicit PythonFunction(nanobind::object function);

  // For those who hold the lock.
  const nanobind::object& get() const { return *function_; }
  void clear() { function_->reset(); }

 private:
  std::shared_ptr<nanobind::object> function_;
};

/// A renderer that asks Python for whole images: `render(t, T_world_camera, T_world_objects, shape)` gives irradiance
/// and depth, and flow and object where it knows them, as _simulate.py promises.
std::unique_ptr<Renderer> make_python_renderer(const PythonFunction& render, const Camera& camera);

}  // namespace esim::python
