#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <exception>
#include <limits>
#include <utility>

#include "bindings.h"
#include "esim/core/error.h"
#include "esim/formats/copy_recording.h"
#include "esim/formats/formats.h"
#include "events/packet_views.h"
#include "remedies.h"
#include "sensor_size.h"

namespace esim::python {
namespace {

namespace fs = std::filesystem;

constexpr TimeNs kEndless = std::numeric_limits<TimeNs>::max() / 2;

/// Sources give records of one camera and kind in order. Records of other cameras and kinds may be late by at most this
/// time: the duration of drivers' messages, or half an exposure.
constexpr TimeNs kMaxDisorder = 500 * kNsPerMs;

/// Reads the recording of a file packet by packet.
class RecordingReader {
 public:
  /// `packet`: length of packets; 0: from one frame of ground truth to the next, if the file contains their rate.
  RecordingReader(const fs::path& path, TimeNs packet, std::optional<int> width, std::optional<int> height,
                  bool recover) {
    ReadOptions options;
    options.sensor = sensor_size(width, height);
    if (recover) options.recover = [this](const std::string& problem) { problems_.push_back(problem); };
    source_ = open_source(path, options);
    info_ = source_->info();
    RecordingInfo endless = info_;
    endless.end = kEndless;  // the end becomes known when it is reached
    const double usual_hz = info_.truth_rate_hz > 0 ? info_.truth_rate_hz : kUsualPacketRate_hz;
    packets_.emplace(PeriodicClock(info_.start, kEndless, packet > 0 ? 1 / to_seconds(packet) : usual_hz));
    packets_->begin(endless);
  }

  std::optional<nb::dict> next() {
    {
      const nb::gil_scoped_release released;
      while (!packets_->has_packet() && !ended_) advance();
    }
    if (packets_->has_packet()) return to_dict(packets_->take(), info_);
    if (damage_) std::rethrow_exception(std::exchange(damage_, nullptr));
    return std::nullopt;
  }

  const RecordingInfo& info() const { return info_; }
  const std::vector<std::string>& problems() const { return problems_; }

 private:
  void advance() {
    if (!read_) {
      read_ = !take();
      if (read_) packets_->set_end(damage_ || !problems_.empty() ? info_.start : info_.end);
    } else if (packets_->covered() < packets_->end()) {
      packets_->know(packets_->covered());  // one packet at a time
    } else {
      packets_->end(true);
      ended_ = true;
    }
  }

  /// False after the last record. Records before a damaged position are returned before the error.
  bool take() {
    try {
      const Record* const record = source_->next();
      if (record == nullptr) return false;
      packets_->write(*record);
      packets_->know(packets_->reached() - kMaxDisorder);
      return true;
    } catch (const UserError&) {
      damage_ = std::current_exception();
      return false;
    }
  }

  std::unique_ptr<Source> source_;
  RecordingInfo info_;
  std::optional<PacketSink> packets_;
  std::vector<std::string> problems_;
  std::exception_ptr damage_;
  bool read_ = false;   // whether the source is read completely
  bool ended_ = false;  // whether all packets are made
};

/// Converts a recording to another format; returns the numbers of copied records, and the losses.
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
