#include "esim/formats/numpy/npy.h"

#include <fmt/format.h>

#include <array>
#include <cstring>
#include <optional>

#include "esim/files/input_file.h"
#include "esim/files/output_file.h"
#include "esim/formats/events_writer.h"
#include "esim/formats/numpy/npy_array.h"

namespace esim::inline formats {
namespace {

class EventArrayWriter final : public EventsWriter {
 public:
  explicit EventArrayWriter(TimeUnit unit)
      : unit_(unit),
        descr_(fmt::format("[('t', '{}'), ('x', '<u2'), ('y', '<u2'), ('p', '|u1')]", numpy::time_type(unit))) {}

  void begin(const std::filesystem::path& path, SensorSize) override {
    file_.emplace(path);
    file_->append(npy::header_text(descr_, std::array{std::uint64_t{0}}));
  }

  void write(EventSpan events) override {
    std::string& bytes = file_->buffer();
    const std::size_t before = bytes.size();
    bytes.resize(before + events.size() * kItemBytes);
    char* out = bytes.data() + before;
    for (const Event& event : events) {
      const std::int64_t t = unit_ == TimeUnit::us ? numpy::microseconds(event.t) : event.t;
      std::memcpy(out, &t, 8);
      std::memcpy(out + 8, &event.x, 2);
      std::memcpy(out + 10, &event.y, 2);
      out[12] = event.polarity > 0 ? 1 : 0;
      out += kItemBytes;
    }
    count_ += events.size();
    if (file_->flush_if_full()) write_count();
  }

  void end() override {
    file_->flush();
    write_count();
    file_->close();
    file_.reset();
  }

 private:
  /// Updated with each flush, so that the file of a killed process can be read.
  void write_count() { file_->overwrite_start(npy::header_text(descr_, std::array{count_})); }

  static constexpr std::size_t kItemBytes = 13;

  TimeUnit unit_;
  std::string descr_;
  std::optional<OutputFile> file_;
  std::uint64_t count_ = 0;
};

std::unique_ptr<EventsReader> open_npy(const std::filesystem::path& path) {
  const auto file = std::make_shared<InputFile>(path);
  const auto array =
      std::make_shared<numpy::Array>(path.string(), [file](std::span<std::byte> out) { return file->read_into(out); });
  numpy::EventColumns columns;
  for (const numpy::Field& field : array->fields()) numpy::take_column(field.name, {array, field}, columns);
  return numpy::make_columns_reader(path.string(), std::move(columns));
}

}  // namespace

Format npy_format() {
  return {
      .name = "npy",
      .description = "NumPy array of records t, x, y, p",
      .extensions = {".npy"},
      .holds = {Content::events},
      .either_unit = true,
      .recognises = [](const auto&, std::string_view head) { return head.starts_with(npy::kMagic); },
      .open = [](const auto& path, const ReadOptions& options) { return make_events_source(open_npy(path), options); },
      .create =
          [](const auto& path, const WriteOptions& options) {
            return make_events_sink(std::make_unique<EventArrayWriter>(options.unit), path, "npy");
          },
  };
}

}  // namespace esim::inline formats
