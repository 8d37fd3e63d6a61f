#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "arrays.h"
#include "bindings.h"
#include "esim/filters/filter_chain.h"
#include "esim/scenario/filter_options.h"

namespace esim::python {
namespace {

nb::object process(FilterChain& chain, const Bytes& events) {
  std::vector<Event> passed;
  {
    const nb::gil_scoped_release released;
    chain.process(events_in(events), passed);
  }
  return bytes_to_numpy(std::move(passed));
}

nb::dict dropped(const FilterChain& chain) {
  nb::dict result;
  for (const FilterChain::Dropped& filter : chain.dropped()) result[filter.filter.c_str()] = filter.events;
  return result;
}

}  // namespace

void bind_filters(nb::module_& module) {
  nb::class_<FilterChain>(module, "FilterChain")
      .def(
          "__init__",
          [](FilterChain* chain, int width, int height, const std::vector<std::string>& options) {
            new (chain) FilterChain(read_filters(options, ""), width, height);
          },
          nb::arg("width"), nb::arg("height"), nb::arg("options"))
      .def("process", &process, nb::arg("events"))
      .def("dropped", &dropped);
}

}  // namespace esim::python
