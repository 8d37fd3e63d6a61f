#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <limits>

#include "bindings.h"
#include "esim/record/copy_recording.h"
#include "packet_views.h"
#include "remedies.h"
#include "sensor_size.h"

namespace esim::python {
namespace {

namespace fs = std::filesystem;

TimeNs last_time(const Record& record) {
  const auto* events = std::get_if<EventsRecord>(&record);
  if (events != nullptr && !events->events.empty()) return events->events.back().t;
  return std::visit(
      [](const auto& kind) {
        if constexpr (requires { kind.t; }) return kind.t;
        if constexpr (requires { kind.t1; }) return kind.t1;
        return std::numeric_limits<TimeNs>::min();
      },
      record);
}

/// A file's recording, packet by packet.
class RecordingReader {
 public:
  RecordingReader(const fs::path& path, TimeNs packet, std::optional<int> width, std::optional<int> height,
                  bool recover) {
    ReadOptions options;
    options.sensor = sensor_size(width, height);
    if (recover) options.recover = [this](const std::string& problem) { problems_.push_back(problem); };
    source_ = open_source(path, options);
    info_ = source_->info();
    RecordingInfo endless = info_;
    endless.end = std::numeric_limits<TimeNs>::max() / 2;  // the end is known when it is there
    packets_.emplace(PeriodicClock(info_.start, endless.end, 1e9 / static_cast<double>(packet)));
    packets_->begin(endless);
  }

  std::optional<nb::dict> next() {
    {
      const nb::gil_scoped_release released;
      while (!packets_->has_packet() && !ended_) advance();
    }
    if (!packets_->has_packet()) return std::nullopt;
    return to_dict(packets_->take(), info_);
  }

  const RecordingInfo& info() const { return info_; }
  const std::vector<std::string>& problems() const { return problems_; }

 private:
  void advance() {
    if (const Record* record = source_->next()) {
      last_ = std::max(last_, last_time(*record));
      packets_->write(*record);
    } else {
      ended_ = true;
      packets_->know(std::max(last_, info_.start));
      packets_->end(false);
    }
  }

  std::unique_ptr<Source> source_;
  RecordingInfo info_;
  std::optional<PacketSink> packets_;
  std::vector<std::string> problems_;
  TimeNs last_ = std::numeric_limits<TimeNs>::min();
  bool ended_ = false;
};

/// Copies a recording into another format; returns how many of what, and what was lost.
nb::tuple convert(const fs::path& from, const fs::path& to, const std::optional<std::string>& name,
                  const std::string& camera, bool from_zero, bool nanoseconds, bool recover, bool force) {
  std::map<std::string, std::uint64_t> copied;
  std::vector<std::string> lost;
  {
    const nb::gil_scoped_release released;
    const Format& format = name ? format_named(*name) : format_for(to);
    ConvertOptions options{{camera, from_zero, {nanoseconds ? TimeUnit::ns : TimeUnit::us}}, {}, force};
    if (recover) options.read.recover = [&lost](const std::string& problem) { lost.push_back(problem); };
    const CopySummary summary = convert_recording(from, format, to, options, [](double) { return true; });
    for (const auto& [content, count] : summary.copied) copied.emplace(describe(content), count);
    for (const Loss& loss : losses(summary, format)) lost.push_back(with_remedy(loss.what, loss.remedy));
  }
  return nb::make_tuple(copied, lost);
}

}  // namespace

void bind_recording_files(nb::module_& module) {
  nb::class_<RecordingReader>(module, "RecordingReader")
      .def(nb::init<const fs::path&, TimeNs, std::optional<int>, std::optional<int>, bool>(), nb::arg("path"),
           nb::arg("packet"), nb::arg("width").none(), nb::arg("height").none(), nb::arg("recover"))
      .def("next", &RecordingReader::next)
      .def("info", [](const RecordingReader& self) { return to_dict(self.info()); })
      .def("problems", &RecordingReader::problems);
  module.def("convert", &convert, nb::arg("source"), nb::arg("target"), nb::arg("format").none(), nb::arg("camera"),
             nb::arg("from_zero"), nb::arg("nanoseconds"), nb::arg("recover"), nb::arg("force"));
}

}  // namespace esim::python
