#include "esim/formats/event_stream/event_stream.h"

#include <fmt/format.h>

#include <cstdint>
#include <optional>

#include "esim/files/input_file.h"
#include "esim/files/output_file.h"
#include "esim/formats/events_reader.h"
#include "esim/formats/events_writer.h"

// A header: the signature, three bytes for the version, one for the type, then width and height of the sensor. Each
// event has five bytes: the time since the event before it in us with flags in the low bits, then x, then y, which is 0
// at the bottom of the sensor. All numbers are little-endian. Before them, bytes may add to the time
// (https://github.com/neuromorphic-paris/event_stream).

namespace esim::inline formats {
namespace {

constexpr std::string_view kSignature = "Event Stream";
constexpr std::size_t kVersionBytes = 3, kSizeBytes = 4, kDvsEventBytes = 5;
constexpr std::uint8_t kMajorVersion = 2;
constexpr int kMaxExtent = 65535;  // px

// Times are differences: 1 byte for each 127 us without events. With this limit, a pause adds at most 135 MB.
constexpr std::int64_t kMaxStreamUs = (std::int64_t{1} << 34) - 1;

enum Type : std::uint8_t { kGeneric, kDvs, kAtis, kDisplay, kColor };

constexpr std::uint8_t kOverflow = 0xFF, kReset = 0xFE;  // of DVS
constexpr std::int64_t kOverflowUs = 127;

constexpr std::uint8_t kAtisOverflow = 0xFC;  // and how many in the low bits; 0: a reset
constexpr std::int64_t kAtisOverflowUs = 63;

void append_u16(std::string& bytes, unsigned value) {
  bytes.push_back(static_cast<char>(value));
  bytes.push_back(static_cast<char>(value >> 8));
}

class EventStreamWriter final : public EventsWriter {
 public:
  void begin(const std::filesystem::path& path, SensorSize sensor) override {
    require_size(path, sensor);
    height_ = static_cast<unsigned>(sensor.height);
    file_.emplace(path);
    std::string& bytes = file_->buffer();
    bytes.append(kSignature);
    for (const std::uint8_t byte : {kMajorVersion, std::uint8_t{0}, std::uint8_t{0}, std::uint8_t{kDvs}})
      bytes.push_back(static_cast<char>(byte));
    append_u16(bytes, static_cast<unsigned>(sensor.width));
    append_u16(bytes, height_);
  }

  void write(EventSpan events) override {
    std::string& bytes = file_->buffer();
    for (const Event& event : events) {
      const std::int64_t us = event.t / kNsPerUs;
      put_overflows((us - us_) / kOverflowUs);
      const auto rest = static_cast<unsigned>((us - us_) % kOverflowUs);
      bytes.push_back(static_cast<char>((rest << 1) | (event.polarity > 0 ? 1U : 0U)));
      append_u16(bytes, event.x);
      append_u16(bytes, height_ - 1 - event.y);
      us_ = us;
      if (bytes.size() >= kFlushBytes) file_->flush_if_full();
    }
    file_->flush_if_full();
  }

  void end() override {
    file_->close();
    file_.reset();
  }

 private:
  static constexpr std::size_t kFlushBytes = 1 << 16;

  void put_overflows(std::int64_t count) {
    for (; count > 0; count -= static_cast<std::int64_t>(kFlushBytes)) {
      const auto part = std::min(static_cast<std::size_t>(count), kFlushBytes);
      file_->buffer().append(part, static_cast<char>(kOverflow));
      file_->flush_if_full();
    }
  }

  std::optional<OutputFile> file_;
  unsigned height_ = 0;
  std::int64_t us_ = 0;
};

class EventStreamReader final : public EventsReader {
 public:
  explicit EventStreamReader(const std::filesystem::path& path) : file_(path) {
    file_.skip(kSignature.size());
    const auto byte = [&](std::size_t index, std::span<const std::byte> bytes) {
      return std::to_integer<std::uint8_t>(bytes[index]);
    };
    const auto version = file_.read_exactly(kVersionBytes, "the version");
    if (byte(0, version) != kMajorVersion) {
      file_.fail(kSignature.size(), fmt::format("version {}.{}.{} of Event Stream is not supported; write version {}",
                                                byte(0, version), byte(1, version), byte(2, version), kMajorVersion));
    }
    const std::uint64_t at = file_.offset();
    type_ = byte(0, file_.read_exactly(1, "the type of the stream"));
    if (type_ != kDvs && type_ != kAtis) refuse_type(at);
    const auto size = file_.read_exactly(kSizeBytes, "the size of the sensor");
    sensor_ = {byte(0, size) | (byte(1, size) << 8), byte(2, size) | (byte(3, size) << 8)};
    if (sensor_.width == 0 || sensor_.height == 0)
      file_.fail(at + 1, fmt::format("the sensor is empty: {} x {} px", sensor_.width, sensor_.height));
  }

  SensorSize sensor() const override { return sensor_; }
  double progress() const override { return file_.progress(); }

  std::vector<std::string> not_read() const override {
    if (exposures_ == 0) return {};
    return {fmt::format("exposure measurements ({})", exposures_)};
  }

  bool read(std::vector<Event>& events) override {
    const std::uint64_t start = file_.offset();
    const auto bytes = file_.read(kBlockBytes);
    if (bytes.empty()) return false;
    const auto* const in = reinterpret_cast<const std::uint8_t*>(bytes.data());
    const std::size_t used =
        type_ == kDvs ? decode<kDvs>(in, bytes.size(), start, events) : decode<kAtis>(in, bytes.size(), start, events);
    if (used == bytes.size()) return true;
    if (bytes.size() < kBlockBytes) file_.fail(start + bytes.size(), "the file ends within an event");
    file_.seek(start + used);
    return true;
  }

 private:
  static constexpr std::size_t kBlockBytes = 1 << 17;
  static constexpr std::int64_t kMaxReadUs = std::int64_t{1} << 52;

  [[noreturn]] void refuse_type(std::uint64_t at) const {
    const char* const name = type_ == kGeneric   ? "generic events"
                             : type_ == kDisplay ? "events of a display"
                             : type_ == kColor   ? "colour events"
                                                 : "an unknown type";
    file_.fail(at,
               fmt::format("the stream holds {} ({}), which have no polarity; only streams of DVS ({}) and ATIS ({}) "
                           "can be read",
                           name, type_, int{kDvs}, int{kAtis}));
  }

  /// Returns how many bytes were used: up to an incomplete event.
  template <Type kType>
  std::size_t decode(const std::uint8_t* in, std::size_t count, std::uint64_t start, std::vector<Event>& events) {
    std::int64_t us = us_;
    std::size_t i = 0;
    while (i < count) {
      const std::uint8_t head = in[i];
      if (kType == kDvs ? head >= kReset : head >= kAtisOverflow) {
        us += kType == kAtis ? kAtisOverflowUs * (head & 3) : head == kOverflow ? kOverflowUs : 0;
        ++i;
        continue;
      }
      if (i + kDvsEventBytes > count) break;
      us += kType == kDvs ? head >> 1 : head >> 2;
      const int x = in[i + 1] | (in[i + 2] << 8), y = in[i + 3] | (in[i + 4] << 8);
      if (x >= sensor_.width || y >= sensor_.height) fail_place(start + i, x, y);
      if (us > kMaxReadUs) file_.fail(start + i, "the times from this byte on are out of range");
      const bool exposure = kType == kAtis && (head & 1) != 0;
      const bool on = (kType == kDvs ? head & 1 : head & 2) != 0;
      if (exposure) {
        ++exposures_;
      } else {
        events.push_back({us * kNsPerUs, static_cast<std::uint16_t>(x),
                          static_cast<std::uint16_t>(sensor_.height - 1 - y), static_cast<std::int8_t>(on ? 1 : -1)});
      }
      i += kDvsEventBytes;
    }
    us_ = us;
    return i;
  }

  [[noreturn]] void fail_place(std::uint64_t at, int x, int y) const {
    file_.fail(at, fmt::format("the event is at ({}, {}), outside the sensor of {} x {} px", x, y, sensor_.width,
                               sensor_.height));
  }

  InputFile file_;
  std::uint8_t type_ = kDvs;
  SensorSize sensor_;
  std::int64_t us_ = 0;
  std::uint64_t exposures_ = 0;
};

}  // namespace

Format event_stream_format() {
  return {
      .name = "es",
      .description = "Event Stream 2.0, DVS; reads ATIS as well",
      .extensions = {".es"},
      .holds = {Content::events},
      .resolution = kNsPerUs,
      .max_width = kMaxExtent,
      .max_height = kMaxExtent,
      .min_time = 0,
      .max_time = kMaxStreamUs * kNsPerUs + kNsPerUs - 1,
      .recognises = [](const auto&, std::string_view head) { return head.starts_with(kSignature); },
      .open =
          [](const auto& path, const ReadOptions& options) {
            return make_events_source(std::make_unique<EventStreamReader>(path), options);
          },
      .create = [](const auto& path,
                   const WriteOptions&) { return make_events_sink(std::make_unique<EventStreamWriter>(), path, "es"); },
  };
}

}  // namespace esim::inline formats
