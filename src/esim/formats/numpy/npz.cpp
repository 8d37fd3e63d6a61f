#include <fmt/format.h>

#include <array>
#include <cstring>

#include "esim/core/error.h"
#include "esim/files/output_file.h"
#include "esim/files/zip_reader.h"
#include "esim/formats/events_writer.h"
#include "esim/formats/label_columns.h"
#include "esim/formats/numpy/npy.h"
#include "esim/formats/numpy/npy_array.h"
#include "esim/formats/zip_archive.h"

namespace esim::inline formats {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kLocalHead = "PK\x03\x04";
constexpr int kMaxArrayExtent = 65536;  // px

/// One column of the events, in a separate file, ARCHIVE.t.npy, until the archive is packed at the end. If the process
/// ends before that, these files hold the data recorded so far.
class ColumnFile {
 public:
  ColumnFile(const fs::path& archive, std::string name, std::string descr)
      : name_(std::move(name)), descr_(std::move(descr)), path_(archive.string() + "." + name_ + ".npy"), file_(path_) {
    file_.append(npy::header_text(descr_, std::array{std::uint64_t{0}}));
  }

  /// Appends number(item) for each event or label.
  template <typename Number, typename Item, typename Function>
  void write(std::span<const Item> items, const Function& number) {
    std::string& bytes = file_.buffer();
    const std::size_t before = bytes.size();
    bytes.resize(before + items.size() * sizeof(Number));
    char* out = bytes.data() + before;
    for (const Item& item : items) {
      const Number value = number(item);
      std::memcpy(out, &value, sizeof(Number));
      out += sizeof(Number);
    }
    count_ += items.size();
    if (file_.flush_if_full()) write_count();
  }

  void close() {
    file_.flush();
    write_count();
    file_.close();
  }

  void remove() const {
    std::error_code ignored;
    fs::remove(path_, ignored);
  }

  const std::string& name() const { return name_; }
  const fs::path& path() const { return path_; }

 private:
  void write_count() { file_.overwrite_start(npy::header_text(descr_, std::array{count_})); }

  std::uint64_t count_ = 0;
  std::string name_, descr_;
  fs::path path_;
  OutputFile file_;
};

class NpzWriter final : public EventsWriter {
 public:
  explicit NpzWriter(const WriteOptions& options) : options_(options) {}

  void begin(const fs::path& path, SensorSize sensor) override {
    OutputFile(path).close();  // fails now rather than at the end
    path_ = path;
    sensor_ = sensor;
    const auto add = [&](std::string name, std::string_view type) {
      columns_.push_back(std::make_unique<ColumnFile>(path, std::move(name), fmt::format("'{}'", type)));
    };
    add("t", numpy::time_type(options_.unit));
    add("x", "<u2");
    add("y", "<u2");
    add("p", "|u1");
    if (!has_labels_) return;
    add("t_ideal", numpy::time_type(options_.unit));
    for (const LabelColumn<float>& column : kLabelParts) add(column.name, "<f4");
    for (const LabelColumn<std::uint16_t>& column : kLabelSurfaces) add(column.name, "<u2");
    add("cause", "|u1");
    add("hot", "|u1");
  }

  void expect_labels() override { has_labels_ = true; }

  void write_labels(LabelSpan labels) override {
    const bool us = options_.unit == TimeUnit::us;
    auto column = columns_.begin() + 4;
    const auto next = [&]() -> ColumnFile& { return **column++; };
    next().write<std::int64_t>(
        labels, [&](const EventLabel& label) { return us ? numpy::microseconds(label.t_ideal) : label.t_ideal; });
    for (const auto& [name, part] : kLabelParts)
      next().write<float>(labels, [member = part](const EventLabel& label) { return label.*member; });
    for (const auto& [name, surface] : kLabelSurfaces)
      next().write<std::uint16_t>(labels, [member = surface](const EventLabel& label) { return label.*member; });
    next().write<std::uint8_t>(labels, [](const EventLabel& label) { return static_cast<std::uint8_t>(label.cause); });
    next().write<std::uint8_t>(labels, [](const EventLabel& label) { return label.hot; });
  }

  void write(EventSpan events) override {
    const bool us = options_.unit == TimeUnit::us;
    columns_[0]->write<std::int64_t>(events,
                                     [&](const Event& event) { return us ? numpy::microseconds(event.t) : event.t; });
    columns_[1]->write<std::uint16_t>(events, [](const Event& event) { return event.x; });
    columns_[2]->write<std::uint16_t>(events, [](const Event& event) { return event.y; });
    columns_[3]->write<std::uint8_t>(events, [](const Event& event) { return std::uint8_t{event.polarity > 0}; });
  }

  void end() override {
    const bool deflated = options_.compression != Compression::none;
    const auto packing = deflated ? ZipWriter::Packing::deflated : ZipWriter::Packing::stored;
    ZipWriter zip(path_);
    for (const auto& column : columns_) {
      column->close();
      zip.add_file(column->name() + ".npy", column->path(), packing);
    }
    if (sensor_.width > 0) {
      zip.add("width.npy", scalar(sensor_.width), packing);
      zip.add("height.npy", scalar(sensor_.height), packing);
    }
    zip.close();
    for (const auto& column : columns_) column->remove();
    columns_.clear();
  }

 private:
  static std::string scalar(std::int32_t value) {
    return npy::header_text("'<i4'", {}) + std::string(reinterpret_cast<const char*>(&value), sizeof(value));
  }

  WriteOptions options_;
  fs::path path_;
  SensorSize sensor_;
  bool has_labels_ = false;
  std::vector<std::unique_ptr<ColumnFile>> columns_;
};

int extent(numpy::Array& array) {
  std::vector<std::int64_t> value;
  if (array.count() != 1 || array.advance(1) != 1 || array.fields().size() != 1) return 0;
  array.integers(array.fields()[0], value);
  return value[0] >= 1 && value[0] <= kMaxArrayExtent ? static_cast<int>(value[0]) : 0;
}

std::unique_ptr<EventsReader> open_npz(const fs::path& path) {
  const ZipReader zip(path);
  numpy::EventColumns columns;
  for (std::size_t i = 0; i < zip.members().size(); ++i) {
    const fs::path name = zip.members()[i].name;
    if (name.extension() != ".npy") continue;
    const auto array = std::make_shared<numpy::Array>(path.string() + ": " + name.string(), zip.open(i));
    if (name == "width.npy") {
      columns.sensor.width = extent(*array);
    } else if (name == "height.npy") {
      columns.sensor.height = extent(*array);
    } else {
      for (const numpy::Field& field : array->fields()) {
        numpy::take_column(field.name.empty() ? name.stem().string() : field.name, {array, field}, columns);
      }
    }
  }
  if (columns.sensor.width == 0 || columns.sensor.height == 0) columns.sensor = {};
  return numpy::make_columns_reader(path.string(), std::move(columns));
}

/// Whether the first member of the zip is a NumPy array.
bool is_npz(std::string_view head) {
  constexpr std::size_t kNameLength = 26, kName = 30;
  if (!head.starts_with(kLocalHead) || head.size() < kName) return false;
  const std::size_t length =
      static_cast<unsigned char>(head[kNameLength]) + 256U * static_cast<unsigned char>(head[kNameLength + 1]);
  return head.substr(kName, length).ends_with(".npy");
}

}  // namespace

Format npz_format() {
  return {
      .name = "npz",
      .description = "NumPy arrays t, x, y, p, and labels, in a zip file",
      .extensions = {".npz"},
      .holds = {Content::events, Content::event_labels},
      .either_unit = true,
      .recognises = [](const auto&, std::string_view head) { return is_npz(head); },
      .open = [](const auto& path, const ReadOptions& options) { return make_events_source(open_npz(path), options); },
      .create =
          [](const auto& path, const WriteOptions& options) {
            return make_events_sink(std::make_unique<NpzWriter>(options), path, "npz");
          },
  };
}

}  // namespace esim::inline formats
