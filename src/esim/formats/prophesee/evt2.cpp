#include <bit>

#include "esim/formats/events_reader.h"
#include "esim/formats/events_writer.h"
#include "esim/formats/prophesee/prophesee.h"

// EVT 2.0: words of 32 bits: type 4, low bits of the time 6, x 11, y 11; or type 4, high bits of the time 28
// (https://docs.prophesee.ai/stable/data/encoding_formats/evt2.html).
// EVT 2.1: words of 64 bits: the same, then a mask of the 32 pixels of the row from x on (.../evt21.html).

namespace esim::inline formats {
namespace {

using prophesee::WordFile;

constexpr int kMaxExtent = 2048;  // px
constexpr int kLowBits = 6, kHighBits = 28;
constexpr std::int64_t kMaxEvt2Us = (std::int64_t{1} << (kLowBits + kHighBits)) - 1;
constexpr std::int64_t kClockSlack = 1024;  // x 64 us

enum Type : std::uint32_t { kOff = 0x0, kOn = 0x1, kTimeHigh = 0x8 };

class Evt2Writer final : public EventsWriter {
 public:
  void begin(const std::filesystem::path& path, SensorSize sensor) override {
    file_.emplace(path, prophesee::raw_header("EVT2", "2.0", sensor));
  }

  void write(EventSpan events) override {
    for (const Event& event : events) {
      const std::int64_t us = event.t / kNsPerUs;
      if (us >> kLowBits != high_) {
        high_ = us >> kLowBits;
        file_->put((kTimeHigh << 28) | static_cast<std::uint32_t>(high_));
      }
      const std::uint32_t type = event.polarity > 0 ? kOn : kOff, low = us & ((1 << kLowBits) - 1);
      file_->put((type << 28) | (low << 22) | (std::uint32_t{event.x} << 11) | event.y);
    }
  }

  void end() override {
    file_->close();
    file_.reset();
  }

 private:
  std::optional<WordFile<std::uint32_t>> file_;
  std::int64_t high_ = -1;
};

/// EVT 2.0 for words of 32 bits, EVT 2.1 for words of 64 bits.
template <typename Word>
class Evt2Reader final : public EventsReader {
 public:
  Evt2Reader(InputFile file, prophesee::Header header) : file_(std::move(file)), header_(std::move(header)) {}

  SensorSize sensor() const override { return header_.sensor; }
  double progress() const override { return file_.progress(); }

  bool read(std::vector<Event>& events) override {
    while (events.size() < kPortion) {
      const std::uint64_t start = file_.offset();
      const auto words = prophesee::read_words(file_, words_, kBlockWords);
      if (words.empty()) return false;
      const bool sound = decode(words);
      portion_.move_to(events);
      if (!sound) file_.fail(start, "the times before this byte are out of range");
    }
    return true;
  }

 private:
  static constexpr bool kVectors = sizeof(Word) == 8;
  static constexpr std::size_t kBlockWords = 2048, kPortion = 1 << 15;

  bool decode(std::span<const Word> words) {
    const bool swap = header_.endianness == "big";
    const bool halves_swapped = header_.endianness == "legacy";
    for (Word next : words) {
      if (swap) next = swapped(next);
      if (halves_swapped) next = std::rotl(next, kVectors ? 32 : 0);
      const auto head = static_cast<std::uint32_t>(next >> (8 * sizeof(Word) - 32));
      const std::uint32_t type = head >> 28;
      if (type == kTimeHigh) {
        const auto high_us = clock_.advance(head & ((1U << kHighBits) - 1));
        if (!high_us) return false;
        high_us_ = *high_us;
        timed_ = true;
      } else if (type <= kOn && timed_) {  // events before the first high bits have no time
        const TimeNs t = (high_us_ + ((head >> 22) & ((1U << kLowBits) - 1))) * kNsPerUs;
        put(t, (head >> 11) & 0x7FF, head & 0x7FF, type == kOn, next);
      }  // otherwise triggers, their continuations, or vendors' own words
    }
    return true;
  }

  void put(TimeNs t, std::uint32_t x, std::uint32_t y, bool on, Word next) {
    if constexpr (kVectors) {
      for (auto valid = static_cast<std::uint32_t>(next); valid != 0; valid &= valid - 1) {
        portion_.put(t, x + static_cast<std::uint32_t>(std::countr_zero(valid)), y, on);
      }
    } else {
      portion_.put(t, x, y, on);
    }
  }

  static Word swapped(Word value) {
    if constexpr (kVectors) return __builtin_bswap64(value);
    return static_cast<Word>(__builtin_bswap32(static_cast<std::uint32_t>(value)));
  }

  InputFile file_;
  prophesee::Header header_;
  std::unique_ptr<Word[]> words_;
  prophesee::Portion portion_{kBlockWords * (kVectors ? 32 : 1)};
  prophesee::WrappingClock clock_{kHighBits, kLowBits, kClockSlack};
  std::int64_t high_us_ = 0;
  bool timed_ = false;
};

std::unique_ptr<EventsReader> open_evt2(const std::filesystem::path& path) {
  InputFile file(path);
  prophesee::Header header = prophesee::read_header(file);
  if (header.encoding == "EVT2") return std::make_unique<Evt2Reader<std::uint32_t>>(std::move(file), header);
  return std::make_unique<Evt2Reader<std::uint64_t>>(std::move(file), header);
}

}  // namespace

Format evt2_format() {
  return {
      .name = "evt2",
      .description = "Prophesee RAW, EVT 2.0; reads EVT 2.1 as well",
      .extensions = {".raw"},
      .holds = {Content::events},
      .resolution = kNsPerUs,
      .max_width = kMaxExtent,
      .max_height = kMaxExtent,
      .min_time = 0,
      .max_time = kMaxEvt2Us * kNsPerUs + kNsPerUs - 1,
      .recognises =
          [](const auto&, std::string_view head) {
            const std::string encoding = prophesee::parse_header(head).encoding;
            return encoding == "EVT2" || encoding == "EVT21";
          },
      .open = [](const auto& path, const ReadOptions& options) { return make_events_source(open_evt2(path), options); },
      .create = [](const auto& path,
                   const WriteOptions&) { return make_events_sink(std::make_unique<Evt2Writer>(), path, "evt2"); },
  };
}

}  // namespace esim::inline formats
