#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include <algorithm>

#include "arrays.h"
#include "bindings.h"
#include "esim/core/error.h"
#include "esim/visualise/event_pictures.h"
#include "esim/visualise/playable.h"
#include "esim/visualise/player.h"
#include "esim/visualise/space_time.h"
#include "sensor_size.h"

namespace esim::python {
namespace {

namespace fs = std::filesystem;

nb::object picture_to_numpy(const Image<Rgb>& picture) {
  std::vector<std::uint8_t> values;
  values.reserve(3 * picture.size());
  for (const Rgb& rgb : picture.pixels()) values.insert(values.end(), {rgb.r, rgb.g, rgb.b});
  return to_numpy(std::move(values),
                  {static_cast<std::size_t>(picture.height()), static_cast<std::size_t>(picture.width()), 3});
}

void require_on_sensor(EventSpan events, int width, int height) {
  if (width < 1 || height < 1 || width > 65536 || height > 65536)
    throw UserError("width and height must be from 1 to 65536 px");
  for (const Event& event : events) {
    if (event.x < width && event.y < height) continue;
    throw UserError("the event at (" + std::to_string(event.x) + ", " + std::to_string(event.y) +
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
      throw UserError("size: width and height must be from 64 to 16384 px");
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

/// The images of a recording, as `esim play` shows them.
class Pages {
 public:
  Pages(const fs::path& path, std::optional<SensorSize> sensor, const std::string& camera, PlayOptions options,
        Extent extent, std::optional<double> at_s) {
    const Playable input(path, sensor);
    extent.camera = input.camera(camera);
    options.name = input.name();
    const auto found = read_overview(*input.open(), extent, [](double) { return true; });
    options = choose_missing(std::move(options), *found);
    instants_ = at_s ? Instants{.first = found->origin + to_ns(*at_s)} : video_instants(*found, options);
    if (instants_.first < found->start || instants_.first > found->end)
      throw UserError("at_s: must be within " + path.string() + ", from 0 to " +
                      std::to_string(to_seconds(found->end - found->origin)) + " s");
    source_ = input.open();
    player_ = std::make_unique<Player>(*source_, extent.camera, *found, options, instants_);
  }

  nb::object next() {
    auto picture = [&] {
      const nb::gil_scoped_release released;
      return player_->next();
    }();
    return picture ? picture_to_numpy(*picture) : nb::none();
  }

  std::vector<TimeNs> times() const {
    std::vector<TimeNs> times;
    for (std::size_t i = 0; i < instants_.count; ++i) times.push_back(instants_.at(i));
    return times;
  }

 private:
  Instants instants_;
  std::unique_ptr<Source> source_;
  std::unique_ptr<Player> player_;
};

std::unique_ptr<Pages> open(const fs::path& path, const std::vector<std::string>& views, const std::string& camera,
                            double fps, double slow_motion, double window_s, std::size_t window_events, double tau_s,
                            double span_s, double start_s, std::optional<double> duration_s, std::optional<double> at_s,
                            int size, bool light, std::optional<int> width, std::optional<int> height) {
  const nb::gil_scoped_release released;
  PlayOptions options;
  options.views = views_named(views);
  options.frames_per_s = fps;
  options.slow_motion = slow_motion;
  options.window_s = window_s;
  options.window_events = window_events;
  options.tau_s = tau_s;
  options.span_s = span_s;
  options.width = size;
  options.theme = light ? kLightTheme : kDarkTheme;
  return std::make_unique<Pages>(path, sensor_size(width, height), camera, options, Extent{0, start_s, duration_s},
                                 at_s);
}

}  // namespace

void bind_pictures(nb::module_& module) {
  module.def("space_time_plot", &space_time_plot);
  module.def("time_surface_picture", &time_surface_picture);
  nb::class_<Pages>(module, "Pages").def("next", &Pages::next).def("times", [](const Pages& self) {
    return to_numpy(self.times());
  });
  module.def("open_pages", &open, nb::arg("path"), nb::arg("views"), nb::arg("camera"), nb::arg("fps"),
             nb::arg("slow_motion"), nb::arg("window_s"), nb::arg("window_events"), nb::arg("tau_s"), nb::arg("span_s"),
             nb::arg("start_s"), nb::arg("duration_s").none(), nb::arg("at_s").none(), nb::arg("size"),
             nb::arg("light"), nb::arg("width").none(), nb::arg("height").none());
}

}  // namespace esim::python
