#include "esim/formats/filter_recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <type_traits>
#include <utility>

#include "esim/core/remedy.h"
#include "esim/files/number_text.h"
#include "esim/filters/labels_of_passed.h"

namespace esim::inline formats {
namespace {

using Json = nlohmann::ordered_json;

/// A visitor of describe() that makes JSON of options.
struct JsonWriter {
  Json json = Json::object();

  template <typename T>
  void operator()(const char* name, T& value, const About&) {
    json[name] = to_value(value);
  }
  template <typename T>
  void operator()(const char* name, std::optional<T>& value, const About&) {
    if (value) json[name] = to_value(*value);
  }

  template <typename T>
  static Json to_value(T& value) {
    if constexpr (std::is_enum_v<T>) {
      return kEnumNames<T>[static_cast<std::size_t>(value)];
    } else if constexpr (std::is_arithmetic_v<T>) {
      return value;
    } else {
      JsonWriter writer;
      describe(writer, value);
      return writer.json;
    }
  }
  template <typename T>
  static Json to_value(std::vector<T>& values) {
    Json list = Json::array();
    for (T& value : values) list.push_back(to_value(value));
    return list;
  }
};

std::string to_json(FilterOptions options) { return JsonWriter::to_value(options).dump(); }

class FilteredSource final : public Source {
 public:
  FilteredSource(std::unique_ptr<Source> inner, const FilterOptions& filters, const std::string& camera,
                 std::vector<FilteredCamera>& cameras)
      : inner_(std::move(inner)), filters_(filters), reports_(cameras) {
    refuse(find_problem(filters_));
    reports_.clear();
    for (const CameraInfo& each : info().cameras) {
      std::optional<std::size_t> report;
      if (camera.empty() || camera == each.name) {
        report = reports_.size();
        reports_.push_back({each.name, 0, {}});
      }
      cameras_.push_back({report, nullptr});
    }
  }

  const RecordingInfo& info() const override { return inner_->info(); }
  double progress() const override { return inner_->progress(); }

  std::vector<std::string> not_read() const override {
    std::vector<std::string> all = inner_->not_read();
    if (has_points_) all.emplace_back("the points of events");
    return all;
  }

  /// Gives a record of events even if it is empty, so that the caller can follow the progress.
  const Record* next() override {
    while (const Record* record = inner_->next()) {
      if (const auto* events = std::get_if<EventsRecord>(record)) return filtered_record(*record, *events);
      if (!std::holds_alternative<EventPointsRecord>(*record)) return record;
      has_points_ = true;
    }
    return nullptr;
  }

 private:
  struct FilteredStream {
    std::optional<std::size_t> report;  // index of its camera in reports_; nothing: it is not filtered
    std::unique_ptr<FilterChain> chain;
  };

  const Record* filtered_record(const Record& record, const EventsRecord& events) {
    FilteredStream& stream = cameras_.at(static_cast<std::size_t>(events.camera));
    if (!stream.report) return &record;
    if (stream.chain == nullptr) stream.chain = make_chain(events.camera);
    passed_.clear();
    stream.chain->process(events.events, passed_);
    FilteredCamera& report = reports_[*stream.report];
    report.events += events.events.size();
    report.dropped = stream.chain->dropped();
    labels_.assign(events.labels.begin(), events.labels.end());
    if (!labels_.empty()) keep_labels_of_passed(events.events, passed_, labels_);
    return &record_.emplace(EventsRecord{events.camera, passed_, labels_});
  }

  std::unique_ptr<FilterChain> make_chain(int camera) const {
    const CameraInfo& known = info().cameras[static_cast<std::size_t>(camera)];
    if (known.model.width > 0 && known.model.height > 0)
      return std::make_unique<FilterChain>(filters_, known.model.width, known.model.height);
    throw RemediableError(fmt::format("the input does not contain the size of the sensor of {}: state it", known.name),
                          Remedy::sensor_size);
  }

  std::unique_ptr<Source> inner_;
  FilterOptions filters_;
  std::vector<FilteredCamera>& reports_;
  std::vector<FilteredStream> cameras_;
  std::vector<Event> passed_;
  std::vector<EventLabel> labels_;
  std::optional<Record> record_;
  bool has_points_ = false;
};

}  // namespace

std::string describe(const std::vector<FilteredCamera>& cameras) {
  std::string text;
  const auto line = [&](const FilteredCamera& camera, const std::string& name, std::uint64_t count, const char* what) {
    const double percent =
        100 * static_cast<double>(count) / static_cast<double>(std::max<std::uint64_t>(camera.events, 1));
    text += fmt::format("  {:<16}{:>15} {:<8}{:>6.1f} %\n", name, grouped(count), what, percent);
  };
  for (const FilteredCamera& camera : cameras) {
    text += fmt::format("{:<18}{:>15} events\n", camera.name, grouped(camera.events));
    for (const FilterChain::Dropped& filter : camera.dropped) line(camera, filter.filter, filter.events, "dropped");
    line(camera, "all", camera.kept(), "kept");
  }
  return text;
}

std::string to_json(const std::vector<FilteredCamera>& cameras) {
  Json list = Json::array();
  for (const FilteredCamera& camera : cameras) {
    Json dropped = Json::object();
    for (const FilterChain::Dropped& filter : camera.dropped) dropped[filter.filter] = filter.events;
    list.push_back({{"name", camera.name}, {"events", camera.events}, {"dropped", dropped}, {"kept", camera.kept()}});
  }
  return list.dump();
}

std::uint64_t FilteredCamera::kept() const {
  std::uint64_t count = events;
  for (const FilterChain::Dropped& filter : dropped) count -= filter.events;
  return count;
}

std::unique_ptr<Source> filtered(std::unique_ptr<Source> inner, const FilterOptions& filters, const std::string& camera,
                                 std::vector<FilteredCamera>& cameras) {
  return std::make_unique<FilteredSource>(std::move(inner), filters, camera, cameras);
}

FilterSummary filter_recording(const std::filesystem::path& from, const Format& format, const std::filesystem::path& to,
                               const FilterOptions& filters, const ConvertOptions& options,
                               const std::function<bool(double)>& go_on) {
  FilterSummary summary;
  ConvertOptions filtering = options;
  filtering.change = [&](std::unique_ptr<Source> input) {
    return filtered(std::move(input), filters, options.copy.camera, summary.cameras);
  };
  filtering.report = [&] {
    return std::map<std::string, std::string>{{"filters", to_json(filters)}, {"filtered", to_json(summary.cameras)}};
  };
  summary.copy = convert_recording(from, format, to, filtering, go_on);
  return summary;
}

}  // namespace esim::inline formats
