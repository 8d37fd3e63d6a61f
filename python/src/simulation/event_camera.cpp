#include "esim/event_camera/event_camera.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "arrays.h"
#include "bindings.h"
#include "esim/compose/compose.h"
#include "esim/core/parallel.h"
#include "esim/scenario/conversion.h"

namespace esim::python {
namespace {

using Frame = nb::ndarray<const float, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

/// An event camera and its threads. _checks.py ensures that frames have its size.
struct OwnedEventCamera {
  OwnedEventCamera(int columns, int rows, const std::vector<std::string>& options, std::uint64_t seed, int threads)
      : OwnedEventCamera(columns, rows, read_event_camera(options, ""), seed, threads) {}

  OwnedEventCamera(int columns, int rows, const EventCameraOptions& options, std::uint64_t seed, int threads)
      : workers(threads), camera(options, columns, rows, seed), warnings(warnings_of_filters(options)) {}

  nb::object process(const Frame& frame, TimeNs t) {
    std::vector<Event> events;
    {
      const nb::gil_scoped_release released;
      camera.process({frame.data(), frame.size()}, t, events, workers);
    }
    return bytes_to_numpy(std::move(events));
  }

  nb::object labels() const {
    const LabelSpan labels = camera.labels();
    return bytes_to_numpy(std::vector<EventLabel>(labels.begin(), labels.end()));
  }

  nb::bytes state() const {
    const std::vector<std::byte> state = [&] {
      const nb::gil_scoped_release released;
      return camera.state();
    }();
    return nb::bytes(state.data(), state.size());
  }

  void restore(const nb::bytes& state) { camera.restore({static_cast<const std::byte*>(state.data()), state.size()}); }

  Workers workers;
  EventCamera camera;
  std::vector<std::string> warnings;
};

}  // namespace

void bind_event_camera(nb::module_& module) {
  nb::class_<OwnedEventCamera>(module, "EventCamera")
      .def(nb::init<int, int, const std::vector<std::string>&, std::uint64_t, int>(), nb::arg("width"),
           nb::arg("height"), nb::arg("options"), nb::arg("seed"), nb::arg("threads"))
      .def("process", &OwnedEventCamera::process, nb::arg("frame").noconvert(), nb::arg("t"))
      .def("labels", &OwnedEventCamera::labels)
      .def("state", &OwnedEventCamera::state)
      .def("restore", &OwnedEventCamera::restore, nb::arg("state"))
      .def_ro("warnings", &OwnedEventCamera::warnings)
      .def("statistics", [](const OwnedEventCamera& self) {
        const EventCameraStatistics statistics = self.camera.statistics();
        return nb::make_tuple(statistics.dropped, statistics.delayed);
      });
}

}  // namespace esim::python
