#include "esim/formats/datasets/nmnist.h"

#include <fmt/format.h>

#include <optional>

#include "esim/files/input_file.h"
#include "esim/files/output_file.h"
#include "esim/formats/events_reader.h"
#include "esim/formats/events_writer.h"

namespace esim::inline formats {
namespace {

constexpr std::size_t kNmnistEventBytes = 5;
constexpr int kDelayRow = 240;
constexpr std::int64_t kDelayUs = 1 << 13;
constexpr std::int64_t kMaxNmnistUs = (1 << 23) - 1;
constexpr int kMaxWidth = 256, kMaxHeight = kDelayRow;  // px

class NmnistWriter final : public EventsWriter {
 public:
  void begin(const std::filesystem::path& path, SensorSize) override { file_.emplace(path); }

  void write(EventSpan events) override {
    std::string& bytes = file_->buffer();
    const std::size_t before = bytes.size();
    bytes.resize(before + events.size() * kNmnistEventBytes);
    char* out = bytes.data() + before;
    for (const Event& event : events) {
      const std::int64_t us = event.t / kNsPerUs;
      *out++ = static_cast<char>(event.x);
      *out++ = static_cast<char>(event.y);
      *out++ = static_cast<char>((us >> 16) | (event.polarity > 0 ? 0x80 : 0));
      *out++ = static_cast<char>(us >> 8);
      *out++ = static_cast<char>(us);
    }
    file_->flush_if_full();
  }

  void end() override {
    file_->close();
    file_.reset();
  }

 private:
  std::optional<OutputFile> file_;
};

/// Turns bytes into events.
class Decoder {
 public:
  /// Nothing for a delay.
  std::optional<Event> decode(const std::uint8_t* bytes) {
    if (bytes[1] == kDelayRow) {
      delay_us_ += kDelayUs;
      return std::nullopt;
    }
    const std::int64_t us = ((bytes[2] & 0x7F) << 16) | (bytes[3] << 8) | bytes[4];
    return Event{(us + delay_us_) * kNsPerUs, bytes[0], bytes[1],
                 static_cast<std::int8_t>((bytes[2] & 0x80) != 0 ? 1 : -1)};
  }

 private:
  std::int64_t delay_us_ = 0;
};

class NmnistReader final : public EventsReader {
 public:
  explicit NmnistReader(const std::filesystem::path& path) : file_(path) {}

  double progress() const override { return file_.progress(); }

  bool read(std::vector<Event>& events) override {
    const std::uint64_t start = file_.offset();
    const auto bytes = file_.read(kPortion * kNmnistEventBytes);
    const auto* const in = reinterpret_cast<const std::uint8_t*>(bytes.data());
    for (std::size_t i = 0; i + kNmnistEventBytes <= bytes.size(); i += kNmnistEventBytes) {
      if (const auto event = decoder_.decode(in + i)) events.push_back(*event);
    }
    if (bytes.size() % kNmnistEventBytes != 0) file_.fail(start + bytes.size(), "the file ends within an event");
    return !bytes.empty();
  }

 private:
  static constexpr std::size_t kPortion = 1 << 15;  // events

  InputFile file_;
  Decoder decoder_;
};

/// Files have no signature: recognised by name, size, and times that do not decrease.
bool is_nmnist(const std::filesystem::path& path, std::string_view head) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (path.extension() != ".bin" || error || size % kNmnistEventBytes != 0) return false;
  const auto* const in = reinterpret_cast<const std::uint8_t*>(head.data());
  Decoder decoder;
  TimeNs last = 0;
  for (std::size_t i = 0; i + kNmnistEventBytes <= head.size(); i += kNmnistEventBytes) {
    const auto event = decoder.decode(in + i);
    if (!event) continue;
    if (event->t < last) return false;
    last = event->t;
  }
  return true;
}

}  // namespace

Format nmnist_format() {
  return {
      .name = "nmnist",
      .description = "five bytes per event, as in N-MNIST",
      .extensions = {".bin"},
      .holds = {Content::events},
      .resolution = kNsPerUs,
      .max_width = kMaxWidth,
      .max_height = kMaxHeight,
      .min_time = 0,
      .max_time = kMaxNmnistUs * kNsPerUs + kNsPerUs - 1,
      .recognises = is_nmnist,
      .open =
          [](const auto& path, const ReadOptions& options) {
            return make_events_source(std::make_unique<NmnistReader>(path), options);
          },
      .create = [](const auto& path,
                   const WriteOptions&) { return make_events_sink(std::make_unique<NmnistWriter>(), path, "nmnist"); },
  };
}

}  // namespace esim::inline formats
