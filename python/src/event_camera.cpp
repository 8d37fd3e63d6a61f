#include "esim/sensors/event_camera.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "arrays.h"
#include "bindings.h"
#include "esim/core/error.h"
#include "esim/core/parallel.h"
#include "esim/scenario/conversion.h"

namespace esim::python {
namespace {

using Frame = nb::ndarray<const float, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

/// An event camera and the threads that it works on.
struct OwnedEventCamera {
  OwnedEventCamera(int columns, int rows, const std::vector<std::string>& options, std::uint64_t seed, int threads)
      : width(columns), height(rows), workers(threads), camera(read_event_camera(options, ""), columns, rows, seed) {}

  nb::object process(const Frame& frame, TimeNs t) {
    if (frame.shape(0) != static_cast<std::size_t>(height) || frame.shape(1) != static_cast<std::size_t>(width)) {
      throw UserError("a frame of " + std::to_string(frame.shape(1)) + " x " + std::to_string(frame.shape(0)) +
                      " px (width x height), but the camera has " + std::to_string(width) + " x " +
                      std::to_string(height) + "; give an array of shape (height, width)");
    }
    std::vector<Event> events;
    {
      const nb::gil_scoped_release released;
      camera.process({frame.data(), frame.size()}, t, events, workers);
    }
    return bytes_to_numpy(std::move(events));
  }

  int width, height;
  Workers workers;
  EventCamera camera;
};

}  // namespace

void bind_event_camera(nb::module_& module) {
  nb::class_<OwnedEventCamera>(module, "EventCamera")
      .def(nb::init<int, int, const std::vector<std::string>&, std::uint64_t, int>(), nb::arg("width"),
           nb::arg("height"), nb::arg("options"), nb::arg("seed"), nb::arg("threads"))
      .def("process", &OwnedEventCamera::process, nb::arg("frame").noconvert(), nb::arg("t"))
      .def("statistics", [](const OwnedEventCamera& self) {
        const EventCameraStatistics statistics = self.camera.statistics();
        return nb::make_tuple(statistics.dropped, statistics.in_flight);
      });
}

}  // namespace esim::python
