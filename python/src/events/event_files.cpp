#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>

#include "arrays.h"
#include "bindings.h"
#include "esim/core/error.h"
#include "esim/formats/events_file.h"
#include "esim/formats/formats.h"
#include "esim/formats/inspect.h"
#include "sensor_size.h"

namespace esim::python {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPortion = 1 << 17;

/// Reads the events of a file, by number or by time.
class EventReader {
 public:
  EventReader(const fs::path& path, std::optional<int> width, std::optional<int> height)
      : file_(path, {sensor_size(width, height), {}}) {}

  /// The next events, at most `count`.
  nb::object take(std::size_t count) {
    std::vector<Event> events;
    {
      const nb::gil_scoped_release released;
      while (events.size() < count && fill()) move_events(std::min(count - events.size(), left()), events);
    }
    return bytes_to_numpy(std::move(events));
  }

  /// The next events before t.
  nb::object take_before(TimeNs t) {
    std::vector<Event> events;
    {
      const nb::gil_scoped_release released;
      while (fill() && portion_[next_].t < t) move_events(count_before(t), events);
    }
    return bytes_to_numpy(std::move(events));
  }

  /// Skips the events before t.
  void skip_before(TimeNs t) {
    const nb::gil_scoped_release released;
    while (fill() && portion_[next_].t < t) next_ += count_before(t);
  }

  /// The time of the next event; empty after the last.
  std::optional<TimeNs> next_time() {
    const nb::gil_scoped_release released;
    if (!fill()) return std::nullopt;
    return portion_[next_].t;
  }

  nb::object sensor() const {
    if (!file_.sensor()) return nb::none();
    return nb::make_tuple(file_.sensor()->width, file_.sensor()->height);
  }

 private:
  std::size_t left() const { return portion_.size() - next_; }

  bool fill() {
    if (left() > 0) return true;
    next_ = 0;
    return file_.read(portion_, kPortion);
  }

  /// The rest of the portion.
  std::size_t count_before(TimeNs t) const {
    const auto first = portion_.begin() + static_cast<std::ptrdiff_t>(next_);
    const auto end = std::partition_point(first, portion_.end(), [t](const Event& event) { return event.t < t; });
    return static_cast<std::size_t>(end - first);
  }

  void move_events(std::size_t count, std::vector<Event>& to) {
    const auto first = portion_.begin() + static_cast<std::ptrdiff_t>(next_);
    to.insert(to.end(), first, first + static_cast<std::ptrdiff_t>(count));
    next_ += count;
  }

  EventsFile file_;
  std::vector<Event> portion_;
  std::size_t next_ = 0;  // of the portion
};

void check(EventSpan events, int width, int height) {
  for (std::size_t i = 0; i < events.size(); ++i) {
    const Event& event = events[i];
    if (event.x >= width || event.y >= height) {
      throw UserError("event " + std::to_string(i) + ": x = " + std::to_string(event.x) +
                      ", y = " + std::to_string(event.y) + " is outside the sensor of " + std::to_string(width) +
                      " x " + std::to_string(height) + " px");
    }
    if (event.polarity != 1 && event.polarity != -1)
      throw UserError("event " + std::to_string(i) + ": p = " + std::to_string(event.polarity) +
                      ", but must be 1 or -1");
    if (i > 0 && event.t < events[i - 1].t) {
      throw UserError("event " + std::to_string(i) + ": its t, " + std::to_string(event.t) +
                      " ns, is before that of the previous event, " + std::to_string(events[i - 1].t) +
                      " ns; sort the events by time");
    }
  }
}

void save(const fs::path& path, const Bytes& bytes, int width, int height, const std::optional<std::string>& name) {
  const EventSpan events = events_in(bytes);
  const nb::gil_scoped_release released;
  check(events, width, height);
  const Format& format = name ? format_named(*name) : format_for(path);
  if (!format.create) throw UserError("format " + format.name + " cannot be written; see esim.formats()");
  if (!format.can_hold(Content::events))
    throw UserError("format " + format.name + " does not contain events; see esim.formats()");
  if (width > format.max_width || height > format.max_height) {
    throw UserError("format " + format.name + " supports sensors of at most " + std::to_string(format.max_width) +
                    " x " + std::to_string(format.max_height) + " px");
  }
  RecordingInfo info;
  CameraInfo camera;
  camera.name = "cam0";
  camera.model.width = width;
  camera.model.height = height;
  info.cameras.push_back(camera);
  if (!events.empty()) info.start = events.front().t, info.end = events.back().t;
  info.start_known = false;
  const std::unique_ptr<Sink> sink = format.create(path, {});
  sink->begin(info);
  for (std::size_t i = 0; i < events.size(); i += kPortion)
    sink->write(EventsRecord{0, events.subspan(i, std::min(kPortion, events.size() - i))});
  sink->end(true);
}

const char* name_of(RecordingStatus status) {
  switch (status) {
    case RecordingStatus::complete:
      return "complete";
    case RecordingStatus::interrupted:
      return "interrupted";
    case RecordingStatus::killed:
      return "killed";
    case RecordingStatus::running:
      return "running";
    case RecordingStatus::unknown:
      return "unknown";
  }
  return "";
}

nb::dict to_dict(const EventsSummary& summary) {
  nb::dict view;
  view["camera"] = summary.camera;
  view["width"] = nb::cast(summary.width);
  view["height"] = nb::cast(summary.height);
  view["events"] = summary.events;
  view["on"] = summary.on;
  view["off"] = summary.off();
  view["t_first"] = summary.events > 0 ? nb::cast(summary.first) : nb::none();
  view["t_last"] = summary.events > 0 ? nb::cast(summary.last) : nb::none();
  view["mean_rate_hz"] = summary.mean_rate_hz();
  view["problem"] = summary.problem.empty() ? nb::none() : nb::object(nb::str(summary.problem.c_str()));
  return view;
}

nb::dict info(const fs::path& path) {
  const Inspection inspection = [&] {
    const nb::gil_scoped_release released;
    return inspect(path);
  }();
  nb::dict view;
  nb::list cameras;
  for (const EventsSummary& summary : inspection.cameras) cameras.append(to_dict(summary));
  view["path"] = nb::cast(inspection.path);
  view["status"] = name_of(inspection.status);
  view["cameras"] = cameras;
  return view;
}

nb::list list_formats() {
  nb::list all;
  for (const Format& format : all_formats()) {
    nb::dict view;
    nb::list contents;
    for (const Content content : format.holds) contents.append(std::string(describe(content)));
    view["name"] = format.name;
    view["description"] = format.description;
    view["extensions"] = nb::cast(format.extensions);
    view["holds"] = contents;
    view["reads"] = static_cast<bool>(format.open);
    view["writes"] = static_cast<bool>(format.create);
    view["resolution_ns"] = format.resolution;
    all.append(view);
  }
  return all;
}

}  // namespace

void bind_event_files(nb::module_& module) {
  nb::class_<EventReader>(module, "EventReader")
      .def(nb::init<const fs::path&, std::optional<int>, std::optional<int>>(), nb::arg("path"),
           nb::arg("width").none(), nb::arg("height").none())
      .def("take", &EventReader::take, nb::arg("count"))
      .def("take_before", &EventReader::take_before, nb::arg("t"))
      .def("skip_before", &EventReader::skip_before, nb::arg("t"))
      .def("next_time", &EventReader::next_time)
      .def("sensor", &EventReader::sensor);
  module.def("save_events", &save, nb::arg("path"), nb::arg("events"), nb::arg("width"), nb::arg("height"),
             nb::arg("format").none());
  module.def("info", &info, nb::arg("path"));
  module.def("formats", &list_formats);
}

}  // namespace esim::python
