#include <fmt/format.h>
#include <zip.h>

#include <array>
#include <cstring>
#include <optional>

#include "esim/core/error.h"
#include "esim/files/output_file.h"
#include "esim/formats/events_writer.h"
#include "esim/formats/numpy/npy.h"
#include "esim/formats/numpy/npy_array.h"

namespace esim::inline formats {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kLocalHead = "PK\x03\x04";
constexpr int kMaxExtent = 65536;  // px

struct DiscardArchive {
  void operator()(zip_t* archive) const { zip_discard(archive); }
};
using Archive = std::unique_ptr<zip_t, DiscardArchive>;

Archive open_archive(const fs::path& path, int flags, std::string& reason) {
  int code = 0;
  Archive archive(zip_open(path.c_str(), flags, &code));
  if (!archive) {
    zip_error_t error;
    zip_error_init_with_code(&error, code);
    reason = zip_error_strerror(&error);
    zip_error_fini(&error);
  }
  return archive;
}

/// One column of the events, in a separate file, ARCHIVE.t.npy, until the archive is packed at the end. If the process
/// ends before that, these files hold the data recorded so far.
class ColumnFile {
 public:
  ColumnFile(const fs::path& archive, std::string name, std::string descr)
      : name_(std::move(name)), descr_(std::move(descr)), path_(archive.string() + "." + name_ + ".npy"), file_(path_) {
    file_.append(npy::header_text(descr_, std::array{std::uint64_t{0}}));
  }

  /// Appends number(event) for each event.
  template <typename Number, typename Function>
  void write(EventSpan events, const Function& number) {
    std::string& bytes = file_.buffer();
    const std::size_t before = bytes.size();
    bytes.resize(before + events.size() * sizeof(Number));
    char* out = bytes.data() + before;
    for (const Event& event : events) {
      const Number value = number(event);
      std::memcpy(out, &value, sizeof(Number));
      out += sizeof(Number);
    }
    count_ += events.size();
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
    std::string reason;
    archive_ = open_archive(path_, ZIP_CREATE | ZIP_TRUNCATE, reason);
    if (!archive_) throw_cannot_write(path_, reason);
    for (const auto& column : columns_) {
      column->close();
      add(column->name(), zip_source_file(archive_.get(), column->path().c_str(), 0, -1));
    }
    const std::string width = scalar(sensor_.width), height = scalar(sensor_.height);
    if (sensor_.width > 0) {
      add("width", zip_source_buffer(archive_.get(), width.data(), width.size(), 0));
      add("height", zip_source_buffer(archive_.get(), height.data(), height.size(), 0));
    }
    if (zip_close(archive_.get()) != 0) fail();
    static_cast<void>(archive_.release());
    sync_file(path_);
    for (const auto& column : columns_) column->remove();
    columns_.clear();
  }

 private:
  static std::string scalar(std::int32_t value) {
    return npy::header_text("'<i4'", {}) + std::string(reinterpret_cast<const char*>(&value), sizeof(value));
  }

  void add(const std::string& name, zip_source_t* source) {
    if (source == nullptr) fail();
    const zip_int64_t index = zip_file_add(archive_.get(), (name + ".npy").c_str(), source, ZIP_FL_ENC_UTF_8);
    if (index < 0) {
      zip_source_free(source);
      fail();
    }
    const auto entry = static_cast<zip_uint64_t>(index);
    const bool packed = options_.compression != Compression::none;
    if (zip_set_file_compression(archive_.get(), entry, packed ? ZIP_CM_DEFLATE : ZIP_CM_STORE, packed ? 1 : 0) != 0 ||
        zip_file_set_dostime(archive_.get(), entry, 0, kFirstOfJanuary1980, 0) != 0) {
      fail();
    }
  }

  [[noreturn]] void fail() const { throw_cannot_write(path_, zip_strerror(archive_.get())); }

  static constexpr zip_uint16_t kFirstOfJanuary1980 = (1 << 5) | 1;  // makes the bytes independent of the date

  WriteOptions options_;
  fs::path path_;
  SensorSize sensor_;
  std::vector<std::unique_ptr<ColumnFile>> columns_;
  Archive archive_;
};

std::shared_ptr<numpy::Array> open_array(const std::shared_ptr<zip_t>& archive, zip_uint64_t index, std::string name) {
  zip_file_t* const opened = zip_fopen_index(archive.get(), index, 0);
  if (opened == nullptr) throw UserError(fmt::format("cannot read {}: {}", name, zip_strerror(archive.get())));
  const std::shared_ptr<zip_file_t> member(opened, [archive](zip_file_t* file) { zip_fclose(file); });
  return std::make_shared<numpy::Array>(name, [member, name](std::span<std::byte> out) {
    const zip_int64_t got = zip_fread(member.get(), out.data(), out.size());
    if (got < 0) throw UserError(fmt::format("cannot read {}: {}", name, zip_file_strerror(member.get())));
    return static_cast<std::size_t>(got);
  });
}

int extent(numpy::Array& array) {
  std::vector<std::int64_t> value;
  if (array.count() != 1 || array.advance(1) != 1 || array.fields().size() != 1) return 0;
  array.integers(array.fields()[0], value);
  return value[0] >= 1 && value[0] <= kMaxExtent ? static_cast<int>(value[0]) : 0;
}

std::unique_ptr<EventsReader> open_npz(const fs::path& path) {
  std::string reason;
  const std::shared_ptr<zip_t> archive = open_archive(path, ZIP_RDONLY, reason);
  if (!archive) throw UserError(fmt::format("cannot read {}: {}", path.string(), reason));
  numpy::EventColumns columns;
  const zip_int64_t members = zip_get_num_entries(archive.get(), 0);
  for (zip_int64_t i = 0; i < members; ++i) {
    const auto index = static_cast<zip_uint64_t>(i);
    const char* const member = zip_get_name(archive.get(), index, 0);
    const fs::path name = member != nullptr ? member : "";
    if (name.extension() != ".npy") continue;
    const auto array = open_array(archive, index, path.string() + ": " + name.string());
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
      .description = "NumPy arrays t, x, y, p in a zip file",
      .extensions = {".npz"},
      .holds = {Content::events},
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
