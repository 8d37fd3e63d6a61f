#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "esim/events/event.h"
#include "esim/formats/prophesee/prophesee.h"

/// The words of EVT 3.0, 16 bits each. The upper four bits are the type; each word changes the state that determines
/// events (https://docs.prophesee.ai/stable/data/encoding_formats/evt3.html).
namespace esim::inline formats::prophesee::evt3 {

inline constexpr int kMaxExtent = 2048;  // px

// The camera's clock has 24 bits, in us: two words hold 12 bits each. It wraps after 16.8 s.
inline constexpr int kTimeBits = 12;

enum Type : std::uint16_t {
  kAddressY = 0x0,
  kAddressX = 0x2,  // an event
  kVectorBase = 0x3,
  kVector12 = 0x4,  // events at twelve pixels of a row from the base on, which advances past them
  kVector8 = 0x5,
  kTimeLow = 0x6,
  kTimeHigh = 0x8,
  kTrigger = 0xA,
};

constexpr std::uint16_t word(Type type, std::uint64_t value) {
  return static_cast<std::uint16_t>((type << 12) | (value & 0xFFF));
}

/// Encodes events. Consecutive events in one row, at one time, of one polarity and from left to right form a run. Dense
/// runs are written as vectors.
class Encoder {
 public:
  /// The words since clear(), valid until the next call. Those of the last run follow when it ends.
  std::span<const std::uint16_t> words() const { return std::span(words_).first(count_); }
  void clear() { count_ = 0; }

  /// The next words do not rely on those before, except for counting the wraps of the clock, which begins at this time.
  void begin(std::int64_t us) {
    if (known_high_ < 0) known_high_ = us >> kTimeBits;
    put_high(us >> kTimeBits);
    *room(1) = word(kTimeHigh, static_cast<std::uint64_t>(known_high_));
    ++count_;
    known_us_ = known_y_ = -1;
  }

  void write(EventSpan events) {
    for (const Event& event : events) {
      const std::int64_t us = event.t / kNsPerUs;
      const bool on = event.polarity > 0;
      // Which of these differ is not predictable, but that one does nearly always is.
      const bool alike = static_cast<bool>((us == us_) & (event.y == y_) & (on == on_));
      if (!alike || size_ == 0 || event.x <= columns_[size_ - 1]) {
        end();
        us_ = us, y_ = event.y, on_ = on;
      }
      columns_[size_++] = event.x;
    }
  }

  /// Ends the run.
  void end() {
    if (size_ == 0) return;
    put_high(us_ >> kTimeBits);
    std::uint16_t* out = room(size_ + 2);
    *out = word(kTimeLow, static_cast<std::uint64_t>(us_));
    out += us_ != known_us_;  // without a branch, which would not be predictable
    *out = word(kAddressY, y_);
    out += y_ != known_y_;
    known_us_ = us_, known_y_ = y_;
    for (std::size_t i = 0; i < size_;) i = put_columns(i, out);
    count_ = static_cast<std::size_t>(out - words_.data());
    size_ = 0;
  }

 private:
  /// The next word, with room for so many.
  std::uint16_t* room(std::size_t words) {
    if (words_.size() - count_ < words) words_.resize(2 * count_ + words + kMaxExtent);
    return words_.data() + count_;
  }

  /// Writes every value of the high bits, as cameras do, so that readers can count the wraps of the clock.
  void put_high(std::int64_t high) {
    if (known_high_ >= high) return;
    const auto missing = static_cast<std::size_t>(high - known_high_);
    std::uint16_t* out = room(missing);
    while (known_high_ < high) *out++ = word(kTimeHigh, static_cast<std::uint64_t>(++known_high_));
    count_ += missing;
  }

  std::size_t count_before(std::size_t first, int column) const {
    std::size_t end = first;
    while (end < size_ && columns_[end] < column) ++end;
    return end - first;
  }

  /// Writes the run from this index on, at most one word for each event; returns the index of the rest.
  std::size_t put_columns(std::size_t first, std::uint16_t*& out) const {
    const std::uint64_t polarity = on_ ? 0x800 : 0;
    int base = columns_[first];
    if (count_before(first, base + 12) < 3) {
      *out++ = word(kAddressX, polarity | columns_[first]);
      return first + 1;
    }
    *out++ = word(kVectorBase, polarity | columns_[first]);
    for (std::size_t count; (count = count_before(first, base + 12)) > 0;) {
      const int length = columns_[first + count - 1] < base + 8 ? 8 : 12;
      std::uint64_t valid = 0;
      for (std::size_t i = first; i < first + count; ++i) valid |= std::uint64_t{1} << (columns_[i] - base);
      *out++ = word(length == 8 ? kVector8 : kVector12, valid);
      first += count;
      base += length;
    }
    return first;
  }

  std::vector<std::uint16_t> words_;  // with room for more
  std::size_t count_ = 0;
  std::array<std::uint16_t, kMaxExtent> columns_{};  // of the run
  std::size_t size_ = 0;
  std::int64_t us_ = 0;
  std::uint16_t y_ = 0;
  bool on_ = false;

  // The decoder state after the words so far.
  std::int64_t known_us_ = -1, known_high_ = -1;
  int known_y_ = -1;
};

/// Decodes words, across any number of calls. Events before the first high bits of the time are left out: they have no
/// time.
class Decoder {
 public:
  /// Calls event(t, x, y, on) and trigger(t, rising). Returns false if times are out of range.
  template <bool kBigEndian, typename OnEvent, typename OnTrigger>
  bool decode(std::span<const std::uint16_t> words, const OnEvent& event, const OnTrigger& trigger) {
    State state = state_;  // a local copy, kept in registers
    for (std::uint16_t next : words) {
      if constexpr (kBigEndian) next = __builtin_bswap16(next);
      const std::uint32_t value = next & 0xFFF;
      switch (next >> 12) {
        case kAddressY:
          state.y = value & 0x7FF;
          break;
        case kAddressX:
          if (state.timed) event(state.t, value & 0x7FF, state.y, (value & 0x800) != 0);
          break;
        case kVectorBase:
          state.base = value & 0x7FF;
          state.on = (value & 0x800) != 0;
          break;
        case kVector12:
          put_vector(state, value, 12, event);
          break;
        case kVector8:
          put_vector(state, value & 0xFF, 8, event);
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
        case kTrigger:
          if (state.timed) trigger(state.t, (value & 1) != 0);
          break;
        default:
          break;  // continuations, or vendors' own words
      }
    }
    state_ = state;
    return true;
  }

 private:
  static constexpr std::int64_t kClockSlack = 16;  // x 4.1 ms

  struct State {
    TimeNs t = 0;
    std::int64_t high_us = 0;
    std::uint32_t low = 0, y = 0, base = 0;
    bool on = false;
    bool timed = false;
  };

  template <typename OnEvent>
  static void put_vector(State& state, std::uint32_t valid, std::uint32_t length, const OnEvent& event) {
    if (state.timed) {
      for (; valid != 0; valid &= valid - 1)
        event(state.t, state.base + static_cast<std::uint32_t>(std::countr_zero(valid)), state.y, state.on);
    }
    state.base += length;
  }

  WrappingClock clock_{kTimeBits, kTimeBits, kClockSlack};
  State state_;
};

}  // namespace esim::inline formats::prophesee::evt3
