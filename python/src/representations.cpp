#include "esim/represent/representations.h"

#include <algorithm>

#include "arrays.h"
#include "bindings.h"
#include "esim/core/error.h"
#include "esim/visualise/event_pictures.h"
#include "esim/visualise/space_time.h"

namespace esim::python {
namespace {

/// What `make` makes, without Python's lock, as an array of images.
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

nb::object picture_to_numpy(const Image<Rgb>& picture) {
  std::vector<std::uint8_t> values;
  values.reserve(3 * picture.size());
  for (const Rgb& rgb : picture.pixels()) values.insert(values.end(), {rgb.r, rgb.g, rgb.b});
  return to_numpy(std::move(values),
                  {static_cast<std::size_t>(picture.height()), static_cast<std::size_t>(picture.width()), 3});
}

void require_on_sensor(EventSpan events, int width, int height) {
  if (width < 1 || height < 1 || width > 65536 || height > 65536)
    throw UserError("width and height of a sensor are from 1 to 65536 px");
  for (const Event& event : events) {
    if (event.x < width && event.y < height) continue;
    throw UserError("an event at (" + std::to_string(event.x) + ", " + std::to_string(event.y) +
                    ") is outside the sensor of " + std::to_string(width) + " x " + std::to_string(height) + " px");
  }
}

nb::object space_time_plot(const Bytes& bytes, int width, int height, int picture_width, int picture_height,
                           double yaw_deg, double pitch_deg) {
  const EventSpan events = events_in(bytes);
  const auto picture = [&] {
    const nb::gil_scoped_release released;
    require_on_sensor(events, width, height);
    if (std::min(picture_width, picture_height) < 64 || std::max(picture_width, picture_height) > 16384)
      throw UserError("size: width and height of a picture are from 64 to 16384 px");
    SpaceTimeBox box{{width, height}, 0, 1, 0};
    if (!events.empty()) box.start = events.front().t - 1, box.end = events.back().t + 1;
    return draw_space_time(events, box, {yaw_deg, pitch_deg}, picture_width, picture_height, Theme{});
  }();
  return picture_to_numpy(picture);
}

nb::object time_surface_picture(const Bytes& bytes, int width, int height, TimeNs t, double tau_s) {
  const auto picture = [&] {
    const nb::gil_scoped_release released;
    const EventSpan events = events_in(bytes);
    require_on_sensor(events, width, height);
    const auto until = std::upper_bound(events.begin(), events.end(), t,
                                        [](TimeNs time, const Event& event) { return time < event.t; });
    TimeSurface surface(PictureGrid{{width, height}, width, height});
    surface.add(events.first(static_cast<std::size_t>(until - events.begin())));
    return surface.draw(t, tau_s * 1e9, Theme{}.ground);
  }();
  return picture_to_numpy(picture);
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
  module.def("space_time_plot", &space_time_plot);
  module.def("time_surface_picture", &time_surface_picture);
}

}  // namespace esim::python
