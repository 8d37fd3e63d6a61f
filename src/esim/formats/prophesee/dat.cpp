#include <fmt/format.h>

#include "esim/formats/events_reader.h"
#include "esim/formats/events_writer.h"
#include "esim/formats/prophesee/prophesee.h"

// DAT: a header, a byte for the type of the events and one for their size, then for each event the time in us, 32 bits,
// and x 14 bits, y 14, polarity 4 (https://docs.prophesee.ai/stable/data/file_formats/dat.html).

namespace esim::inline formats {
namespace {

constexpr int kMaxExtent = 1 << 14;  // px
constexpr std::int64_t kMaxDatUs = 0xFFFF'FFFF;
constexpr std::uint64_t kDatTurnUs = kMaxDatUs + 1;

constexpr char kEventSize = 8;
constexpr char kEvent2d = 0x00, kEventCd = 0x0C;  // two types with the same content

bool is_dat(std::string_view head) {
  const prophesee::Header header = prophesee::parse_header(head);
  const std::string_view rest = head.substr(header.bytes);
  return header.bytes > 0 && header.encoding.empty() && rest.size() >= 2 && rest[1] == kEventSize;
}

class DatWriter final : public EventsWriter {
 public:
  void begin(const std::filesystem::path& path, SensorSize sensor) override {
    std::string header = "% Data file containing CD events\n% Version 2\n";
    if (sensor.width > 0) header += fmt::format("% Width {}\n% Height {}\n", sensor.width, sensor.height);
    file_.emplace(path, header + kEventCd + kEventSize);
  }

  void write(EventSpan events) override {
    for (const Event& event : events) {
      const std::uint64_t place = event.x | (std::uint64_t{event.y} << 14) | (event.polarity > 0 ? 1ULL << 28 : 0);
      file_->put(static_cast<std::uint64_t>(event.t / kNsPerUs) | (place << 32));
    }
  }

  void end() override {
    file_->close();
    file_.reset();
  }

 private:
  std::optional<prophesee::WordFile<std::uint64_t>> file_;
};

class DatReader final : public EventsReader {
 public:
  explicit DatReader(const std::filesystem::path& path) : file_(path), header_(prophesee::read_header(file_)) {
    const auto type = static_cast<char>(file_.read_exactly(2, "the type of its events")[0]);
    if (type != kEvent2d && type != kEventCd) {
      file_.fail(header_.bytes, fmt::format("events of type {} are not supported; those of cameras have type {} or {}",
                                            static_cast<int>(type), int{kEvent2d}, int{kEventCd}));
    }
  }

  SensorSize sensor() const override { return header_.sensor; }
  double progress() const override { return file_.progress(); }

  bool read(std::vector<Event>& events) override {
    const auto words = prophesee::read_words(file_, words_, kBlockWords);
    for (const std::uint64_t word : words) {
      const auto us = static_cast<std::uint32_t>(word), place = static_cast<std::uint32_t>(word >> 32);
      if (us < last_us_ && last_us_ - us > kDatTurnUs / 2) turns_us_ += kDatTurnUs;
      last_us_ = us;
      portion_.put(static_cast<TimeNs>(turns_us_ + us) * kNsPerUs, place & 0x3FFF, (place >> 14) & 0x3FFF,
                   place >> 28 != 0);
    }
    portion_.move_to(events);
    if (turns_us_ > kMaxTurnsUs) file_.fail(file_.offset(), "the times before this byte are out of range");
    return !words.empty();
  }

 private:
  static constexpr std::size_t kBlockWords = 1 << 15;
  static constexpr std::uint64_t kMaxTurnsUs = std::uint64_t{1} << 52;  // plus what one block may add

  InputFile file_;
  prophesee::Header header_;
  std::unique_ptr<std::uint64_t[]> words_;
  prophesee::Portion portion_{kBlockWords};
  std::uint64_t turns_us_ = 0;
  std::uint32_t last_us_ = 0;
};

}  // namespace

Format dat_format() {
  return {
      .name = "dat",
      .description = "Prophesee DAT, version 2",
      .extensions = {".dat"},
      .holds = {Content::events},
      .resolution = kNsPerUs,
      .max_width = kMaxExtent,
      .max_height = kMaxExtent,
      .min_time = 0,
      .max_time = kMaxDatUs * kNsPerUs + kNsPerUs - 1,
      .recognises = [](const auto&, std::string_view head) { return is_dat(head); },
      .open = [](const auto& path,
                 const ReadOptions& options) { return make_events_source(std::make_unique<DatReader>(path), options); },
      .create = [](const auto& path,
                   const WriteOptions&) { return make_events_sink(std::make_unique<DatWriter>(), path, "dat"); },
  };
}

}  // namespace esim::inline formats
