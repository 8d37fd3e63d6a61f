#include "esim/formats/jaer/aedat2.h"

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <optional>

#include "esim/core/load_unaligned.h"
#include "esim/files/input_file.h"
#include "esim/files/output_file.h"
#include "esim/formats/events_reader.h"
#include "esim/formats/events_writer.h"
#include "esim/formats/jaer/header.h"

// A header, then for each event its address and its time in us, 32 bits each, big-endian
// (https://docs.inivation.com/software/software-advanced-usage/file-formats/aedat-2.0.html). What an address means
// depends on the chip. Pixels are counted from the lower right corner.

namespace esim::inline formats {
namespace {

using jaer::Layout;

static_assert(std::endian::native == std::endian::little, "the bytes of numbers are swapped");

constexpr std::size_t kRecordBytes = 8;
constexpr std::int64_t kMaxAedat2Us = 0xFFFF'FFFF;
constexpr std::int64_t kAedat2TurnUs = kMaxAedat2Us + 1;

// DAVIS
constexpr int kYShift = 22, kXShift = 12, kPolarityShift = 11;
constexpr std::uint32_t kSample = 1U << 31;                           // of a frame, or of the IMU if bit 11 is set
constexpr std::uint32_t kImu = 1U << 11;                              // if kSample is set
constexpr std::uint32_t kSpecial = 1U << 10;                          // otherwise
constexpr std::uint32_t kTriggerKind = 7, kFalling = 2, kRising = 3;  // of special events without a pixel

// DVS128
constexpr std::uint32_t kDvs128Pixel = 0x7FFF, kDvs128Trigger = 0x8000;

void append_u32(std::string& bytes, std::uint32_t value) {
  const std::uint32_t swapped = __builtin_bswap32(value);
  bytes.append(reinterpret_cast<const char*>(&swapped), sizeof(swapped));
}

std::uint32_t u32_at(const std::byte* bytes) { return __builtin_bswap32(load_unaligned<std::uint32_t>(bytes)); }

class Aedat2Writer final : public EventsWriter {
 public:
  void begin(const std::filesystem::path& path, SensorSize sensor) override {
    require_size(path, sensor);
    sensor_ = sensor;
    file_.emplace(path);
    file_->append(jaer::davis_header(sensor));
  }

  void write(EventSpan events) override {
    std::string& bytes = file_->buffer();
    for (const Event& event : events) {
      const auto x = static_cast<std::uint32_t>(sensor_.width - 1 - event.x),
                 y = static_cast<std::uint32_t>(sensor_.height - 1 - event.y);
      append_u32(bytes, (y << kYShift) | (x << kXShift) | (event.polarity > 0 ? 1U << kPolarityShift : 0U));
      append_u32(bytes, static_cast<std::uint32_t>(event.t / kNsPerUs));
    }
    file_->flush_if_full();
  }

  void end() override {
    file_->close();
    file_.reset();
  }

 private:
  std::optional<OutputFile> file_;
  SensorSize sensor_;
};

class Aedat2Reader final : public EventsReader {
 public:
  Aedat2Reader(const std::filesystem::path& path, const ReadOptions& options)
      : file_(path), chip_(jaer::read_header(file_, options.sensor)) {}

  SensorSize sensor() const override { return chip_.sensor; }
  double progress() const override { return file_.progress(); }

  std::vector<std::string> not_read() const override {
    std::vector<std::string> all;
    const auto note = [&](std::uint64_t count, const char* what) {
      if (count > 0) all.push_back(fmt::format("{} ({})", what, count));
    };
    note(frame_samples_, "samples of frames");
    note(imu_samples_, "samples of the IMU");
    note(marked_, "events that are marked as special, such as noise in files of v2e");
    note(others_, "unknown special events");
    return all;
  }

  bool read(std::vector<Event>& events) override {
    const std::uint64_t start = file_.offset();
    const auto bytes = file_.read(kBlockRecords * kRecordBytes);
    std::size_t i = 0;
    for (; i + kRecordBytes <= bytes.size(); i += kRecordBytes) {
      const Place place{u32_at(bytes.data() + i), u32_at(bytes.data() + i + 4), start + i};
      if (chip_.layout == Layout::davis) {
        take_davis(place, events);
      } else {
        take_dvs128(place, events);
      }
    }
    if (i < bytes.size()) file_.fail(start + bytes.size(), "the file ends within an event");
    return !bytes.empty();
  }

  void read_triggers(std::vector<TriggerRecord>& triggers) override {
    triggers.insert(triggers.end(), triggers_.begin(), triggers_.end());
    triggers_.clear();
  }

 private:
  static constexpr std::size_t kBlockRecords = 1 << 15;
  static constexpr std::int64_t kMaxTurnsUs = std::int64_t{1} << 52;

  struct Place {
    std::uint32_t address = 0, us = 0;
    std::uint64_t byte = 0;
  };

  void take_davis(const Place& place, std::vector<Event>& events) {
    const std::uint32_t address = place.address;
    if ((address & kSample) != 0) {
      ++((address & kImu) != 0 ? imu_samples_ : frame_samples_);
    } else if ((address & kSpecial) == 0) {
      put(place, (address >> kXShift) & 0x3FF, address >> kYShift, ((address >> kPolarityShift) & 1) != 0, events);
    } else if ((address & ~(kSpecial | kTriggerKind)) != 0) {
      ++marked_;
    } else {
      const std::uint32_t kind = address & kTriggerKind;
      put_trigger(place, kind == kFalling  ? TriggerKind::external_falling
                         : kind == kRising ? TriggerKind::external_rising
                                           : TriggerKind::external_pulse);
    }
  }

  void take_dvs128(const Place& place, std::vector<Event>& events) {
    const std::uint32_t address = place.address, flags = address & ~kDvs128Pixel;
    if (flags == 0) {
      put(place, (address >> 1) & 0x7F, (address >> 8) & 0x7F, (address & 1) == 0, events);
    } else if (flags == kDvs128Trigger) {
      put_trigger(place, TriggerKind::external_falling);
    } else {
      ++others_;
    }
  }

  void put(const Place& place, std::uint32_t x, std::uint32_t y, bool on, std::vector<Event>& events) {
    const auto width = static_cast<std::uint32_t>(chip_.sensor.width),
               height = static_cast<std::uint32_t>(chip_.sensor.height);
    if (x >= width || y >= height) {
      file_.fail(place.byte, fmt::format("the event has the address ({}, {}), outside the sensor of {} x {} px", x, y,
                                         width, height));
    }
    events.push_back({time_of(place), static_cast<std::uint16_t>(width - 1 - x),
                      static_cast<std::uint16_t>(height - 1 - y), static_cast<std::int8_t>(on ? 1 : -1)});
  }

  void put_trigger(const Place& place, TriggerKind kind) { triggers_.push_back({0, time_of(place), kind}); }

  /// The time in the file wraps to 0. Smaller steps back are no wraps; the check of the order handles them.
  TimeNs time_of(const Place& place) {
    if (place.us < last_us_ && last_us_ - place.us > kAedat2TurnUs / 2) turns_us_ += kAedat2TurnUs;
    last_us_ = place.us;
    if (turns_us_ > kMaxTurnsUs) file_.fail(place.byte, "the times from this byte on are out of range");
    return (turns_us_ + place.us) * kNsPerUs;
  }

  InputFile file_;
  jaer::Chip chip_;
  std::vector<TriggerRecord> triggers_;
  std::int64_t turns_us_ = 0;
  std::uint32_t last_us_ = 0;
  std::uint64_t frame_samples_ = 0, imu_samples_ = 0, marked_ = 0, others_ = 0;
};

}  // namespace

Format aedat2_format() {
  return {
      .name = "aedat2",
      .description = "AEDAT 2.0 of jAER and v2e, DAVIS; reads DVS128 as well",
      .extensions = {".aedat", ".aedat2"},
      .holds = {Content::events},
      .resolution = kNsPerUs,
      .max_width = jaer::kMaxDavisWidth,
      .max_height = jaer::kMaxDavisHeight,
      .min_time = 0,
      .max_time = kMaxAedat2Us * kNsPerUs + kNsPerUs - 1,
      .recognises = [](const auto&, std::string_view head) { return head.starts_with(jaer::kSignature); },
      .open =
          [](const auto& path, const ReadOptions& options) {
            return make_events_source(std::make_unique<Aedat2Reader>(path, options), options);
          },
      .create = [](const auto& path,
                   const WriteOptions&) { return make_events_sink(std::make_unique<Aedat2Writer>(), path, "aedat2"); },
  };
}

}  // namespace esim::inline formats
