#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "esim/files/input_file.h"
#include "esim/files/output_file.h"
#include "esim/recording/format.h"

namespace esim::inline formats {

Format evt3_format();
Format evt2_format();
Format dat_format();

}  // namespace esim::inline formats

/// Common parts of Prophesee's file formats
namespace esim::inline formats::prophesee {

static_assert(std::endian::native == std::endian::little, "words are copied between memory and files as they are");

/// The header: lines "% KEY VALUE". Missing or invalid values are empty or 0.
struct Header {
  std::string encoding{};    ///< in capitals, from the key "format" or "evt": EVT2, EVT21, EVT3
  std::string endianness{};  ///< little, big or legacy
  SensorSize sensor{};       ///< from the key "geometry", "format", or "width" and "height"
  std::size_t bytes = 0;     ///< up to and including the end of its last line
  bool ended = false;  ///< the last line is "% end"; otherwise the header ends with the last line that starts with "% "
};

/// Parses the header in a file's first bytes.
Header parse_header(std::string_view head);

/// Reads the header; the next byte is the first of the events.
Header read_header(InputFile& file);

/// A header as in Prophesee's tools; version as in "3.0". Without lines for a sensor of unknown size.
std::string raw_header(std::string_view encoding, std::string_view version, SensorSize sensor);

/// The next words of the file, at most so many; fails if only a part of a word is left.
template <typename Word>
std::span<const Word> read_words(InputFile& file, std::unique_ptr<Word[]>& words, std::size_t max) {
  const std::uint64_t start = file.offset();
  const std::span<const std::byte> bytes = file.read(max * sizeof(Word));
  const std::size_t count = bytes.size() / sizeof(Word);
  if (count == 0 && !bytes.empty()) file.fail(start, "the file ends within a word");
  if (!words) words = std::make_unique<Word[]>(max);
  std::memcpy(words.get(), bytes.data(), count * sizeof(Word));
  if (bytes.size() % sizeof(Word) != 0) file.seek(start + count * sizeof(Word));
  return {words.get(), count};
}

/// Writes a file of words of equal size.
template <typename Word>
class WordFile {
 public:
  WordFile(const std::filesystem::path& path, std::string_view header) : file_(path) { file_.append(header); }

  void put(Word word) {
    words_[count_] = word;
    if (++count_ == kCapacity) flush();
  }

  void close() {
    flush();
    file_.close();
  }

 private:
  static constexpr std::size_t kCapacity = (std::size_t{1} << 16) / sizeof(Word);

  void flush() {
    file_.append({reinterpret_cast<const char*>(words_.get()), count_ * sizeof(Word)});
    count_ = 0;
  }

  OutputFile file_;
  std::unique_ptr<Word[]> words_ = std::make_unique<Word[]>(kCapacity);
  std::size_t count_ = 0;
};

/// A buffer of decoded events, from which portions are made.
class Portion {
 public:
  explicit Portion(std::size_t capacity) : events_(std::make_unique<Event[]>(capacity)) {}

  void put(TimeNs t, std::uint32_t x, std::uint32_t y, bool on) {
    Event& event = events_[count_++];
    event.t = t;
    event.x = static_cast<std::uint16_t>(x);
    event.y = static_cast<std::uint16_t>(y);
    event.polarity = on ? 1 : -1;
  }

  void move_to(std::vector<Event>& events) {
    events.insert(events.end(), events_.get(), events_.get() + count_);
    count_ = 0;
  }

 private:
  std::unique_ptr<Event[]> events_;
  std::size_t count_ = 0;
};

/// A clock of some bits, in us, which wraps to 0. Its high bits come in separate words.
class WrappingClock {
 public:
  /// A step back by more than `slack` is a wrap. Smaller steps back are not; the check of the order handles them.
  WrappingClock(int high_bits, int low_bits, std::int64_t slack)
      : turn_us_(std::int64_t{1} << (high_bits + low_bits)), low_bits_(low_bits), slack_(slack) {}

  /// The time of a word with these high bits since the start of the file's first clock period, us; nothing if it is out
  /// of range.
  std::optional<std::int64_t> advance(std::int64_t high) {
    if (high + slack_ < high_) turns_us_ += turn_us_;
    high_ = high;
    if (turns_us_ > kMaxUs) return std::nullopt;
    return turns_us_ + (high << low_bits_);
  }

 private:
  static constexpr std::int64_t kMaxUs = std::int64_t{1} << 52;

  std::int64_t turn_us_, turns_us_ = 0;
  int low_bits_;
  std::int64_t slack_, high_ = 0;
};

}  // namespace esim::inline formats::prophesee
