#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

/// The prefix codes of deflate (RFC 1951, 3.2), and tables that find what they stand for.
namespace esim::deflate {

static_assert(std::endian::native == std::endian::little, "bits are taken as they come");

inline constexpr unsigned kLongest = 15;               ///< bits of a code
inline constexpr std::size_t kMostSymbols = 288 + 32;  ///< literals and lengths, and distances

/// Bits, from the lowest of each byte on. Behind the end there must be some dozen more bytes of memory.
class Bits {
 public:
  explicit Bits(std::span<const std::uint8_t> bytes) : next_(bytes.data()), end_(next_ + bytes.size()) {}

  /// Makes at least 56 bits known; beyond the end they are anything.
  void refill() {
    std::uint64_t word = 0;
    std::memcpy(&word, next_, sizeof word);
    bits_ |= word << count_;
    next_ += (63 - count_) >> 3;
    count_ |= 56;
  }
  /// To be asked every few refills.
  bool is_past_end() const { return next_ > end_ + sizeof bits_; }

  std::uint32_t peek(unsigned count) const { return static_cast<std::uint32_t>(bits_ & ((1U << count) - 1)); }
  void skip(unsigned count) { bits_ >>= count, count_ -= count; }
  std::uint32_t take(unsigned count) {
    const std::uint32_t value = peek(count);
    skip(count);
    return value;
  }

  /// What follows from the next whole byte on; bits count from there now.
  std::span<const std::uint8_t> bytes() {
    next_ -= count_ >> 3;
    bits_ = 0, count_ = 0;
    return next_ <= end_ ? std::span(next_, end_) : std::span<const std::uint8_t>();
  }
  void skip_bytes(std::size_t count) { next_ += count; }

 private:
  const std::uint8_t *next_, *end_;
  std::uint64_t bits_ = 0;
  unsigned count_ = 0;
};

/// What a code stands for. From the lowest bit on: 6 bits, how many bits to skip; 2 bits, how many literals, which then
/// follow, a byte each. Without literals: 4 bits, what it is; 4 bits, how many bits follow it; 16 bits, what to add
/// them to.
class Entry {
 public:
  enum Kind : std::uint32_t { kNone, kNumber, kEnd, kTable };

  constexpr Entry() = default;
  static constexpr Entry literal(std::uint32_t byte) { return Entry(1U << 6 | byte << 8); }
  static constexpr Entry other(Kind kind, std::uint32_t bits = 0, std::uint32_t base = 0) {
    return Entry(kind << 8 | bits << 12 | base << 16);
  }

  constexpr Entry of_bits(unsigned count) const { return Entry(value_ | count); }
  constexpr unsigned bits() const { return value_ & 63; }
  constexpr unsigned literals() const { return value_ >> 6 & 3; }
  constexpr std::uint32_t bytes() const { return value_ >> 8; }  ///< the first is the lowest
  constexpr Kind kind() const { return static_cast<Kind>(value_ >> 8 & 15); }
  constexpr unsigned extra_bits() const { return value_ >> 12 & 15; }
  constexpr std::uint32_t base() const { return value_ >> 16; }

  /// This one's only literal, then those of `next`.
  constexpr Entry followed_by(Entry next) const {
    return Entry((value_ + (next.value_ & 0xFF)) | (next.value_ >> 8) << 16);
  }

 private:
  constexpr explicit Entry(std::uint32_t value) : value_(value) {}

  std::uint32_t value_ = 0;
};

/// Of lengths or distances from `base` on: as many as the bits behind a code tell apart. None is behind those before
/// `first_wide`, then one behind as many as `per_width`, then two, and so on.
template <std::size_t kCount>
constexpr std::array<Entry, kCount> ranges(std::uint32_t base, std::size_t per_width, std::size_t first_wide) {
  std::array<Entry, kCount> entries{};
  for (std::size_t i = 0; i < kCount; ++i) {
    const auto bits = static_cast<std::uint32_t>(i < first_wide ? 0 : (i - first_wide) / per_width + 1);
    entries[i] = Entry::other(Entry::kNumber, bits, base);
    base += 1U << bits;
  }
  return entries;
}

inline constexpr std::size_t kLiterals = 256, kLengths = 29, kDistances = 30;

/// Literals, the end, lengths.
inline constexpr auto kSymbols = [] {
  std::array<Entry, kLiterals + 1 + kLengths> symbols{};
  for (std::uint32_t i = 0; i < kLiterals; ++i) symbols[i] = Entry::literal(i);
  symbols[kLiterals] = Entry::other(Entry::kEnd);
  const auto lengths = ranges<kLengths>(3, 4, 8);
  std::copy(lengths.begin(), lengths.end(), symbols.begin() + kLiterals + 1);
  symbols.back() = Entry::other(Entry::kNumber, 0, 258);
  return symbols;
}();

inline constexpr auto kDistanceSymbols = ranges<kDistances>(1, 2, 4);

inline constexpr auto kLengthSymbols = [] {
  std::array<Entry, 19> symbols{};
  for (std::uint32_t i = 0; i < symbols.size(); ++i) symbols[i] = Entry::other(Entry::kNumber, 0, i);
  return symbols;
}();

/// Finds what a code stands for: by its first bits, and in a further table by the others where there are more. Where
/// literals are joined, up to three whose codes together are no longer than these bits are found at once.
template <unsigned kFirst, bool kJoins = false>
class Table {
 public:
  /// `lengths` of the symbols' codes, in bits, 0: has none. False where there are more or fewer codes than such lengths
  /// allow; one alone, of one bit, may be.
  bool build(std::span<const std::uint8_t> lengths, std::span<const Entry> symbols) {
    std::array<std::uint16_t, kLongest + 2> begin{};  // in `sorted`, by length
    for (const std::uint8_t length : lengths) ++begin[length + std::size_t{1}];
    begin[1] = 0;
    int room = 1;
    for (std::size_t length = 1; length <= kLongest; ++length) {
      room = 2 * room - begin[length + 1];
      if (room < 0) return false;
      begin[length + 1] = static_cast<std::uint16_t>(begin[length + 1] + begin[length]);
    }
    const bool is_at_most_one = begin[2] <= 1 && begin[2] == begin[kLongest + 1];
    if (room > 0 && !is_at_most_one) return false;
    std::array<Entry, kMostSymbols> sorted;
    auto at = begin;
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      if (lengths[i] > 0) sorted[at[lengths[i]]++] = i < symbols.size() ? symbols[i] : Entry();
    }
    fill(begin, sorted.data());
    return true;
  }

  const Entry* entries() const { return entries_.data(); }
  Entry look(const Bits& bits) const { return entries_[bits.peek(kFirst)]; }

  /// What an entry that names a table finds there.
  Entry look_further(Entry entry, Bits& bits) const {
    bits.skip(kFirst);
    return entries_[entry.base() + bits.peek(entry.extra_bits())];
  }

 private:
  static constexpr std::size_t kSize = std::size_t{1} << kFirst;

  /// Literals' codes, one behind the other; the first bit is the lowest.
  struct Word {
    std::uint32_t code;
    Entry entry;
  };

  /// Words in order of their lengths.
  struct Words {
    std::array<Word, kSize> words;  // no more, for none begins as another
    std::array<std::size_t, kFirst + 2> begin;

    std::span<const Word> of_length(unsigned length) const {
      return std::span(words).subspan(begin[length], begin[length + 1] - begin[length]);
    }
  };

  /// The next code in order, of as many bits.
  static void advance(std::uint32_t& code, unsigned length) {
    std::uint32_t bit = 1U << (length - 1);
    for (; (code & bit) != 0; bit >>= 1) code ^= bit;
    code |= bit;
  }

  /// `sorted`: symbols in order of their codes, those of a length from begin[length] on.
  void fill(const std::array<std::uint16_t, kLongest + 2>& begin, const Entry* sorted) {
    entries_.resize(kSize);
    entries_[0] = {};
    std::uint32_t code = 0;
    std::size_t singles = 0;
    for (unsigned length = 1; length <= kFirst; ++length) {
      // What is known by fewer bits is so whatever the next one is.
      const std::size_t half = std::size_t{1} << (length - 1);
      std::copy_n(entries_.begin(), half, entries_.begin() + static_cast<std::ptrdiff_t>(half));
      singles_.begin[length] = singles;
      for (std::size_t i = begin[length]; i < begin[length + 1]; ++i, advance(code, length)) {
        entries_[code] = sorted[i].of_bits(length);
        if (kJoins && sorted[i].literals() > 0) singles_.words[singles++] = {code, entries_[code]};
      }
      singles_.begin[length + 1] = singles;
      if constexpr (kJoins) join(length);
    }
    fill_further(code, begin, sorted);
  }

  /// From the first code on that is longer.
  void fill_further(std::uint32_t code, const std::array<std::uint16_t, kLongest + 2>& begin, const Entry* sorted) {
    unsigned longest = kLongest;
    while (longest > kFirst && begin[longest] == begin[longest + 1]) --longest;
    const unsigned bits = longest - kFirst;
    const std::size_t size = std::size_t{1} << bits;
    for (unsigned length = kFirst + 1; length <= longest; ++length) {
      for (std::size_t i = begin[length]; i < begin[length + 1]; ++i, advance(code, length)) {
        const std::size_t first = code % kSize;
        if (entries_[first].kind() != Entry::kTable) {
          entries_[first] = Entry::other(Entry::kTable, bits, static_cast<std::uint32_t>(entries_.size()));
          entries_.resize(entries_.size() + size);
        }
        Entry* const table = &entries_[entries_[first].base()];
        for (std::size_t at = code / kSize; at < size; at += std::size_t{1} << (length - kFirst))
          table[at] = sorted[i].of_bits(length - kFirst);
      }
    }
  }

  /// Enters the words of two and three literals that have so many bits together.
  void join(unsigned length) {
    std::size_t pairs = length == 1 ? 0 : pairs_.begin[length];
    pairs_.begin[length] = pairs;
    for (unsigned before = 1; before < length; ++before) {
      for (const Word& first : singles_.of_length(before)) {
        const auto enter = [&](const Word& rest) {
          const Word word{first.code | rest.code << before, first.entry.followed_by(rest.entry)};
          entries_[word.code] = word.entry;
          return word;
        };
        for (const Word& second : singles_.of_length(length - before)) pairs_.words[pairs++] = enter(second);
        for (const Word& second : pairs_.of_length(length - before)) enter(second);
      }
    }
    pairs_.begin[length + 1] = pairs;
  }

  std::vector<Entry> entries_;
  Words singles_, pairs_;
};

}  // namespace esim::deflate
