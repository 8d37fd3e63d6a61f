#include "esim/represent/representations.h"

#include <algorithm>

#include "arrays.h"
#include "bindings.h"
#include "esim/preview/colours.h"

namespace esim::python {
namespace {

/// The result of `make`, computed without the GIL, as an array of images.
template <typename Make>
nb::object stack_to_numpy(Make make) {
  auto stack = [&] {
    const nb::gil_scoped_release released;
    return make();
  }();
  const auto count = static_cast<std::size_t>(stack.count), height = static_cast<std::size_t>(stack.height),
             width = static_cast<std::size_t>(stack.width);
  return to_numpy(std::move(stack.values), {count, height, width});
}

nb::object frame(const Bytes& events, int width, int height) {
  const auto colour = [](const Rgb& rgb) { return Colour{rgb.r, rgb.g, rgb.b}; };
  const FramePalette palette{colour(kOnColour), colour(kOffColour), {255, 255, 255}};
  auto values = [&] {
    const nb::gil_scoped_release released;
    return event_frame(events_in(events), width, height, palette);
  }();
  return to_numpy(std::move(values), {static_cast<std::size_t>(height), static_cast<std::size_t>(width), 3});
}

}  // namespace

void bind_representations(nb::module_& module) {
  module.def("count_events", [](const Bytes& events, int width, int height) {
    return stack_to_numpy([&] { return count_events(events_in(events), width, height); });
  });
  module.def("count_and_stamp", [](const Bytes& events, int width, int height, TimeNs t0, TimeNs t1, bool mean) {
    const StampChoice stamp = mean ? StampChoice::mean : StampChoice::last;
    return stack_to_numpy([&] { return count_and_stamp(events_in(events), width, height, {t0, t1}, stamp); });
  });
  module.def("voxel_grid",
             [](const Bytes& events, int width, int height, int bins, TimeNs t0, TimeNs t1, bool normalise) {
               return stack_to_numpy([&] {
                 auto grid = voxel_grid(events_in(events), width, height, bins, {t0, t1});
                 if (normalise) standardise(grid.values);
                 return grid;
               });
             });
  module.def("time_surface", [](const Bytes& events, int width, int height, TimeNs t, double tau_s) {
    return stack_to_numpy([&] { return time_surface(events_in(events), width, height, t, tau_s); });
  });
  module.def("event_frame", &frame);
}

}  // namespace esim::python
