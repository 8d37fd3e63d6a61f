#include <array>
#include <bit>

#include "esim/formats/events_reader.h"
#include "esim/formats/events_writer.h"
#include "esim/formats/prophesee/prophesee.h"

// EVT 3.0: words of 16 bits. The upper four bits are the type; each word changes the state that determines events
// (https://docs.prophesee.ai/stable/data/encoding_formats/evt3.html).

namespace esim::inline formats {
namespace {

using prophesee::WordFile;

constexpr int kMaxExtent = 2048;  // px

// The camera's clock has 24 bits, in us: two words hold 12 bits each. It wraps after 16.8 s, but files may be longer,
// up to the maximum time of EVT 2.0.
constexpr int kTimeBits = 12;
constexpr std::int64_t kMaxUs = (std::int64_t{1} << 34) - 1;
constexpr std::int64_t kClockSlack = 16;  // x 4.1 ms

enum Type : std::uint16_t {
  kAddressY = 0x0,
  kAddressX = 0x2,  // an event
  kVectorBase = 0x3,
  kVector12 = 0x4,  // events at twelve pixels of a row from the base on, which advances past them
  kVector8 = 0x5,
  kTimeLow = 0x6,
  kTimeHigh = 0x8,
};

constexpr std::uint16_t word(Type type, std::uint64_t value) {
  return static_cast<std::uint16_t>((type << 12) | (value & 0xFFF));
}

/// Consecutive events in one row, at one time, of one polarity and from left to right form a run. Dense runs are
/// written as vectors.
class Evt3Writer final : public EventsWriter {
 public:
  void begin(const std::filesystem::path& path, SensorSize sensor) override {
    file_.emplace(path, prophesee::raw_header("EVT3", "3.0", sensor));
  }

  void write(EventSpan events) override {
    for (const Event& event : events) {
      const std::int64_t us = event.t / kNsPerUs;
      const bool on = event.polarity > 0;
      const bool continues = size_ > 0 && us == us_ && event.y == y_ && on == on_ && event.x > columns_[size_ - 1];
      if (!continues) {
        put_run();
        us_ = us, y_ = event.y, on_ = on;
      }
      columns_[size_++] = event.x;
    }
  }

  void end() override {
    put_run();
    file_->close();
    file_.reset();
  }

 private:
  void put_run() {
    if (size_ == 0) return;
    if (us_ != known_us_) put_time();
    if (y_ != known_y_) file_->put(word(kAddressY, y_));
    known_y_ = y_;
    for (std::size_t i = 0; i < size_;) i = put_columns(i);
    size_ = 0;
  }

  /// Writes every value of the high bits, as cameras do, so that readers can count the wraps of the clock.
  void put_time() {
    const std::int64_t high = us_ >> kTimeBits;
    while (known_high_ < high) file_->put(word(kTimeHigh, static_cast<std::uint64_t>(++known_high_)));
    file_->put(word(kTimeLow, static_cast<std::uint64_t>(us_)));
    known_us_ = us_;
  }

  std::size_t count_before(std::size_t first, int column) const {
    std::size_t end = first;
    while (end < size_ && columns_[end] < column) ++end;
    return end - first;
  }

  /// Writes the run from this index on; returns the index of the rest.
  std::size_t put_columns(std::size_t first) {
    const std::uint64_t polarity = on_ ? 0x800 : 0;
    int base = columns_[first];
    if (count_before(first, base + 12) < 3) {
      file_->put(word(kAddressX, polarity | columns_[first]));
      return first + 1;
    }
    file_->put(word(kVectorBase, polarity | columns_[first]));
    for (std::size_t count; (count = count_before(first, base + 12)) > 0;) {
      const int length = columns_[first + count - 1] < base + 8 ? 8 : 12;
      std::uint64_t valid = 0;
      for (std::size_t i = first; i < first + count; ++i) valid |= std::uint64_t{1} << (columns_[i] - base);
      file_->put(word(length == 8 ? kVector8 : kVector12, valid));
      first += count;
      base += length;
    }
    return first;
  }

  std::optional<WordFile<std::uint16_t>> file_;
  std::array<std::uint16_t, kMaxExtent> columns_{};  // of the run
  std::size_t size_ = 0;
  std::int64_t us_ = 0;
  std::uint16_t y_ = 0;
  bool on_ = false;

  // The decoder state after the words read so far.
  std::int64_t known_us_ = -1, known_high_ = -1;
  int known_y_ = -1;
};

class Evt3Reader final : public EventsReader {
 public:
  explicit Evt3Reader(const std::filesystem::path& path) : file_(path), header_(prophesee::read_header(file_)) {}

  SensorSize sensor() const override { return header_.sensor; }
  double progress() const override { return file_.progress(); }

  bool read(std::vector<Event>& events) override {
    while (events.size() < kPortion) {
      const std::uint64_t start = file_.offset();
      const auto words = prophesee::read_words(file_, words_, kBlockWords);
      if (words.empty()) return false;
      const bool sound = header_.endianness == "big" ? decode<true>(words) : decode<false>(words);
      portion_.move_to(events);
      if (!sound) file_.fail(start, "the times before this byte are out of range");
    }
    return true;
  }

 private:
  static constexpr std::size_t kBlockWords = 4096, kPortion = 1 << 15;

  template <bool kBigEndian>
  bool decode(std::span<const std::uint16_t> words) {
    State state = state_;  // a local copy, kept in registers
    for (std::uint16_t next : words) {
      if constexpr (kBigEndian) next = __builtin_bswap16(next);
      const std::uint32_t value = next & 0xFFF;
      switch (next >> 12) {
        case kAddressY:
          state.y = value & 0x7FF;
          break;
        case kAddressX:
          if (state.timed) portion_.put(state.t, value & 0x7FF, state.y, (value & 0x800) != 0);
          break;
        case kVectorBase:
          state.base = value & 0x7FF;
          state.on = (value & 0x800) != 0;
          break;
        case kVector12:
          put_vector(state, value, 12);
          break;
        case kVector8:
          put_vector(state, value & 0xFF, 8);
          break;
        case kTimeLow:
          state.low = value;
          state.t = (state.high_us + state.low) * kNsPerUs;
          break;
        case kTimeHigh: {
          const auto high_us = clock_.advance(value);
          if (!high_us) return false;
          state.high_us = *high_us;
          state.t = (state.high_us + state.low) * kNsPerUs;
          state.timed = true;
          break;
        }
        default:
          break;  // triggers, their continuations, or vendors' own words
      }
    }
    state_ = state;
    return true;
  }

  struct State {
    TimeNs t = 0;
    std::int64_t high_us = 0;
    std::uint32_t low = 0, y = 0, base = 0;
    bool on = false;
    bool timed = false;  // events before the first high bits have no time
  };

  void put_vector(State& state, std::uint32_t valid, std::uint32_t length) {
    if (state.timed) {
      for (; valid != 0; valid &= valid - 1) {
        portion_.put(state.t, state.base + static_cast<std::uint32_t>(std::countr_zero(valid)), state.y, state.on);
      }
    }
    state.base += length;
  }

  InputFile file_;
  prophesee::Header header_;
  std::unique_ptr<std::uint16_t[]> words_;
  prophesee::Portion portion_{12 * kBlockWords};
  prophesee::WrappingClock clock_{kTimeBits, kTimeBits, kClockSlack};
  State state_;
};

}  // namespace

Format evt3_format() {
  return {
      .name = "evt3",
      .description = "Prophesee RAW, EVT 3.0",
      .extensions = {".raw"},
      .holds = {Content::events},
      .resolution = kNsPerUs,
      .max_width = kMaxExtent,
      .max_height = kMaxExtent,
      .min_time = 0,
      .max_time = kMaxUs * kNsPerUs + kNsPerUs - 1,
      .recognises = [](const auto&, std::string_view head) { return prophesee::parse_header(head).encoding == "EVT3"; },
      .open =
          [](const auto& path, const ReadOptions& options) {
            return make_events_source(std::make_unique<Evt3Reader>(path), options);
          },
      .create = [](const auto& path,
                   const WriteOptions&) { return make_events_sink(std::make_unique<Evt3Writer>(), path, "evt3"); },
  };
}

}  // namespace esim::inline formats
