#include "esim/core/inflate.h"

#include <libdeflate.h>

#include <array>
#include <cstring>
#include <memory>

#include "esim/core/deflate_codes.h"

namespace esim {
namespace {

using deflate::Bits;
using deflate::Entry;

constexpr unsigned kSymbolBits = 12;  // that one look goes by

/// What a block is coded by.
struct Codes {
  deflate::Table<kSymbolBits, true> symbols;
  deflate::Table<8> distances;
  deflate::Table<7> lengths;  // of the other two's codes
};

/// A stream's blocks, one after the other.
class Inflater {
 public:
  /// `codes`: memory to work in.
  Inflater(std::span<const std::uint8_t> stream, std::span<std::uint8_t> out, Codes& codes)
      : codes_(codes), bits_(stream), begin_(out.data()), to_(begin_), end_(begin_ + out.size()) {}

  /// Whether they fill the output, and nothing is wrong with them.
  bool run() {
    bool is_last = false;
    while (!is_last) {
      if (bits_.is_past_end()) return false;
      bits_.refill();
      is_last = bits_.take(1) != 0;
      if (!read_block()) return false;
    }
    return to_ == end_;
  }

  /// What follows the blocks.
  std::span<const std::uint8_t> rest() { return bits_.bytes(); }

 private:
  bool read_block() {
    switch (bits_.take(2)) {
      case 0:
        return copy_stored();
      case 1:
        return build_fixed_codes() && read_symbols();
      case 2:
        return read_codes() && read_symbols();
      default:
        return false;
    }
  }

  bool copy_stored() {
    const std::span<const std::uint8_t> bytes = bits_.bytes();
    constexpr std::size_t kHead = 4;
    if (bytes.size() < kHead) return false;
    const std::size_t size = bytes[0] | bytes[1] << 8, check = bytes[2] | bytes[3] << 8;
    if ((size ^ check) != 0xFFFF || size > bytes.size() - kHead || size > static_cast<std::size_t>(end_ - to_))
      return false;
    std::memcpy(to_, bytes.data() + kHead, size);
    to_ += size;
    bits_.skip_bytes(kHead + size);
    return true;
  }

  bool build_fixed_codes() {
    std::array<std::uint8_t, 288> lengths;
    for (std::size_t i = 0; i < lengths.size(); ++i)
      lengths[i] = static_cast<std::uint8_t>(i < 144 ? 8 : i < 256 ? 9 : i < 280 ? 7 : 8);
    std::array<std::uint8_t, 32> of_distances;
    of_distances.fill(5);
    return codes_.symbols.build(lengths, deflate::kSymbols) &&
           codes_.distances.build(of_distances, deflate::kDistanceSymbols);
  }

  bool read_codes() {
    const std::size_t symbols = 257 + bits_.take(5), distances = 1 + bits_.take(5), lengths = 4 + bits_.take(4);
    constexpr std::uint8_t kOrder[] = {16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15};
    std::array<std::uint8_t, std::size(kOrder)> of_lengths{};
    for (std::size_t i = 0; i < lengths; ++i) {
      bits_.refill();
      of_lengths[kOrder[i]] = static_cast<std::uint8_t>(bits_.take(3));
    }
    std::array<std::uint8_t, deflate::kMostSymbols> all;
    const auto of_symbols = std::span(all).first(symbols), of_distances = std::span(all).subspan(symbols, distances);
    return codes_.lengths.build(of_lengths, deflate::kLengthSymbols) &&
           read_lengths(std::span(all).first(symbols + distances)) &&
           codes_.symbols.build(of_symbols, deflate::kSymbols) &&
           codes_.distances.build(of_distances, deflate::kDistanceSymbols);
  }

  bool read_lengths(std::span<std::uint8_t> all) {
    constexpr std::uint32_t kRepeat = 16;  // the last one; then a few zeros, and many
    constexpr unsigned kBits[] = {2, 3, 7};
    constexpr std::uint32_t kLeast[] = {3, 3, 11};
    for (std::size_t i = 0; i < all.size();) {
      if (bits_.is_past_end()) return false;
      bits_.refill();
      const Entry entry = codes_.lengths.look(bits_);
      if (entry.kind() != Entry::kNumber) return false;
      bits_.skip(entry.bits());
      const std::uint32_t symbol = entry.base();
      if (symbol < kRepeat) {
        all[i++] = static_cast<std::uint8_t>(symbol);
        continue;
      }
      const std::size_t count = kLeast[symbol - kRepeat] + bits_.take(kBits[symbol - kRepeat]);
      if (count > all.size() - i || (symbol == kRepeat && i == 0)) return false;
      std::fill_n(all.begin() + static_cast<std::ptrdiff_t>(i), count,
                  symbol == kRepeat ? all[i - 1] : std::uint8_t{0});
      i += count;
    }
    return true;
  }

  /// Until the block's end. A turn reads and writes less than kInflateMargin behind the ends.
  bool read_symbols() {
    Bits bits = bits_;  // in registers
    std::uint8_t* to = to_;
    const Entry* const entries = codes_.symbols.entries();
    bits.refill();
    Entry entry = entries[bits.peek(kSymbolBits)];
    // The next entry is looked for before more bits are waited for.
    const auto put_literals = [&] {
      if (entry.literals() == 0) return false;
      put(entry, bits, to);
      entry = entries[bits.peek(kSymbolBits)];
      return true;
    };
    while (!bits.is_past_end() && to <= end_) {
      bits.refill();
      if (put_literals() && put_literals() && put_literals()) continue;
      bits.refill();
      if (entry.kind() == Entry::kTable) entry = codes_.symbols.look_further(entry, bits);
      if (entry.literals() > 0) {
        put(entry, bits, to);
      } else {
        bits.skip(entry.bits());
        if (entry.kind() == Entry::kEnd) {
          bits_ = bits, to_ = to;
          return to <= end_;
        }
        if (entry.kind() != Entry::kNumber || !repeat(entry.base() + bits.take(entry.extra_bits()), bits, to))
          return false;
        bits.refill();
      }
      entry = entries[bits.peek(kSymbolBits)];
    }
    return false;
  }

  static void put(Entry literals, Bits& bits, std::uint8_t*& to) {
    const std::uint32_t bytes = literals.bytes();
    std::memcpy(to, &bytes, sizeof bytes);
    to += literals.literals();
    bits.skip(literals.bits());
  }

  /// So many bytes that are there already.
  bool repeat(std::size_t length, Bits& bits, std::uint8_t*& to) const {
    Entry entry = codes_.distances.look(bits);
    if (entry.kind() == Entry::kTable) entry = codes_.distances.look_further(entry, bits);
    if (entry.kind() != Entry::kNumber) return false;
    bits.skip(entry.bits());
    const std::size_t distance = entry.base() + bits.take(entry.extra_bits());
    if (distance > static_cast<std::size_t>(to - begin_)) return false;

    // By the byte until as many are there as to copy words of.
    constexpr std::size_t kWord = 8;
    const std::size_t period = (kWord + distance - 1) / distance * distance;
    std::uint8_t* const end = to + length;
    for (std::size_t there = distance; there < period; ++there, ++to) *to = *(to - distance);
    for (; to < end; to += kWord) std::memcpy(to, to - period, kWord);
    to = end;
    return true;
  }

  Codes& codes_;
  Bits bits_;
  std::uint8_t *begin_, *to_, *end_;
};

}  // namespace

bool inflate_zlib(std::span<const std::uint8_t> stream, std::span<std::uint8_t> out) {
  constexpr std::size_t kHead = 2, kChecksum = 4;
  if (stream.size() < kHead + kChecksum) return false;
  const std::uint32_t method = stream[0], flags = stream[1];
  constexpr std::uint32_t kDeflate = 8, kDictionary = 0x20;
  if (method % 16 != kDeflate || method >> 4 > 7 || (method << 8 | flags) % 31 != 0 || (flags & kDictionary) != 0)
    return false;
  thread_local const auto codes = std::make_unique<Codes>();
  Inflater inflater(stream.subspan(kHead), out, *codes);
  if (!inflater.run()) return false;
  const std::span<const std::uint8_t> rest = inflater.rest();
  if (rest.size() < kChecksum) return false;
  const std::uint32_t expected = std::uint32_t{rest[0]} << 24 | rest[1] << 16 | rest[2] << 8 | rest[3];
  return libdeflate_adler32(1, out.data(), out.size()) == expected;
}

}  // namespace esim
