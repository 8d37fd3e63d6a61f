// Against what zlib compresses, in every way that it can.
#include "esim/core/inflate.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <string>
#include <vector>

namespace esim {
namespace {

using Bytes = std::vector<std::uint8_t>;

class Noise {
 public:
  explicit Noise(std::uint32_t seed) : state_(seed) {}
  std::uint32_t below(std::uint32_t end) {
    state_ = 1664525 * state_ + 1013904223;
    return static_cast<std::uint32_t>(std::uint64_t{state_} * end >> 32);
  }

 private:
  std::uint32_t state_;
};

struct Way {
  int level, memory, strategy;
};

Bytes compressed(const Bytes& data, const Way& way) {
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, way.level, Z_DEFLATED, 15, way.memory, way.strategy), Z_OK);
  Bytes out(deflateBound(&stream, data.size()));
  stream.next_in = const_cast<std::uint8_t*>(data.data()), stream.avail_in = static_cast<uInt>(data.size());
  stream.next_out = out.data(), stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

/// Inflates to so many bytes, with no more memory around than is asked for; nothing where that fails.
Bytes inflated(const Bytes& stream, std::size_t size, bool& is_good) {
  constexpr std::uint8_t kGuard = 0xA5;
  Bytes in = stream, out(size + kInflateMargin + 64, kGuard);
  in.resize(stream.size() + kInflateMargin, 0xFF);
  is_good = inflate_zlib(std::span(in).first(stream.size()), std::span(out).first(size));
  const auto behind = out.begin() + static_cast<std::ptrdiff_t>(size + kInflateMargin);
  EXPECT_TRUE(std::all_of(behind, out.end(), [](std::uint8_t byte) { return byte == kGuard; })) << size;
  out.resize(size);
  return out;
}

bool is_refused(const Bytes& stream, std::size_t size) {
  bool is_good = true;
  inflated(stream, size, is_good);
  return !is_good;
}

/// Few values or many, alone or in runs and periods, evenly or not: codes of one bit to the longest.
Bytes data_of(std::size_t size, int kind) {
  Noise noise(static_cast<std::uint32_t>(kind + 1));
  Bytes data(size);
  for (std::size_t i = 0; i < size; ++i) {
    const std::size_t period = static_cast<std::size_t>(kind) - 5;
    switch (kind) {
      case 0:
        data[i] = static_cast<std::uint8_t>(noise.below(256));
        break;
      case 1:
        data[i] = static_cast<std::uint8_t>(noise.below(2));
        break;
      case 2:  // the fewer, the larger
        data[i] = static_cast<std::uint8_t>(noise.below(1U << noise.below(9)));
        break;
      case 3:  // each half as frequent as the one before: the longest codes
        while (data[i] < 24 && noise.below(2) != 0) ++data[i];
        break;
      case 4:  // a row of pixels, of which the filter has left little
        data[i] = static_cast<std::uint8_t>(i % 4 == 3 ? 0 : noise.below(9) - 4);
        break;
      case 5:
        break;
      default:
        data[i] = static_cast<std::uint8_t>(i < period || noise.below(400) == 0 ? noise.below(256) : data[i - period]);
    }
  }
  return data;
}

TEST(Inflate, WhateverIsCompressed) {
  for (int kind = 0; kind < 26; ++kind) {
    for (const std::size_t size : {0, 1, 2, 7, 100, 70'000}) {
      const Bytes data = data_of(size, kind);
      for (const int strategy : {Z_DEFAULT_STRATEGY, Z_FILTERED, Z_HUFFMAN_ONLY, Z_RLE, Z_FIXED}) {
        for (const auto& [level, memory] : {std::pair{0, 8}, {1, 9}, {6, 1}, {9, 8}}) {
          bool is_good = false;
          EXPECT_EQ(inflated(compressed(data, {level, memory, strategy}), size, is_good), data)
              << "kind " << kind << ", size " << size << ", strategy " << strategy << ", level " << level;
          ASSERT_TRUE(is_good) << "kind " << kind << ", size " << size << ", strategy " << strategy;
        }
      }
    }
  }
}

TEST(Inflate, OtherSizesAreRefused) {
  for (int kind = 0; kind < 7; ++kind) {
    const Bytes data = data_of(1000, kind), stream = compressed(data, {9, 8, Z_DEFAULT_STRATEGY});
    for (const std::size_t size : {0, 1, 500, 990, 995, 998, 999, 1001, 1002, 1300, 2000})
      EXPECT_TRUE(is_refused(stream, size)) << size;
  }
}

TEST(Inflate, MoreThanThereIsRoomForThenStoredBytes) {
  const Bytes more = data_of(5000, 0);
  for (std::size_t count = 1; count < 20; ++count) {
    const Bytes data = data_of(count, 4);
    z_stream stream{};
    ASSERT_EQ(deflateInit2(&stream, 9, Z_DEFLATED, 15, 8, Z_HUFFMAN_ONLY), Z_OK);
    Bytes out(10'000);
    stream.next_out = out.data(), stream.avail_out = static_cast<uInt>(out.size());
    stream.next_in = const_cast<std::uint8_t*>(data.data()), stream.avail_in = static_cast<uInt>(count);
    ASSERT_EQ(deflate(&stream, Z_BLOCK), Z_OK);
    ASSERT_EQ(deflateParams(&stream, 0, Z_DEFAULT_STRATEGY), Z_OK);
    stream.next_in = const_cast<std::uint8_t*>(more.data()), stream.avail_in = static_cast<uInt>(more.size());
    ASSERT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
    out.resize(stream.total_out);
    deflateEnd(&stream);
    EXPECT_FALSE(is_refused(out, count + more.size()));
    for (std::size_t size = 0; size < count + 10; ++size) EXPECT_TRUE(is_refused(out, size)) << size << " of " << count;
  }
}

TEST(Inflate, DamageIsFoundWhereverItIs) {
  for (const int strategy : {Z_DEFAULT_STRATEGY, Z_FIXED, Z_RLE}) {
    for (const int level : {0, 9}) {
      const Bytes data = data_of(400, 4), stream = compressed(data, {level, 8, strategy});
      for (std::size_t i = 0; i < stream.size(); ++i) {
        EXPECT_TRUE(is_refused(Bytes(stream.begin(), stream.begin() + static_cast<std::ptrdiff_t>(i)), data.size()));
        for (int bit = 0; bit < 8; ++bit) {
          Bytes damaged = stream;
          damaged[i] = static_cast<std::uint8_t>(damaged[i] ^ 1 << bit);
          bool is_good = false;
          const Bytes out = inflated(damaged, data.size(), is_good);
          EXPECT_TRUE(!is_good || out == data) << "bit " << bit << " of byte " << i;
        }
      }
    }
  }
}

TEST(Inflate, NonsenseStaysWithinItsMemory) {
  Noise noise(3);
  for (int i = 0; i < 20'000; ++i) {
    // Its size hardly ever fits, and its checksum never.
    Bytes stream = {0x78, 0x01, static_cast<std::uint8_t>(noise.below(256))};
    const std::uint32_t size = noise.below(200);
    while (stream.size() < size) stream.push_back(static_cast<std::uint8_t>(noise.below(256)));
    EXPECT_TRUE(is_refused(stream, noise.below(300)));
  }
}

TEST(Inflate, CodesThatCannotBe) {
  // One dynamic block that begins with 257 codes for symbols, one for distances, and four lengths for their lengths.
  const auto block = [](std::uint32_t lengths) {
    std::uint64_t bits = 1 | 2 << 1 | std::uint64_t{lengths} << 17;
    Bytes stream = {0x78, 0x01};
    for (int i = 0; i < 40; ++i, bits >>= 8) stream.push_back(static_cast<std::uint8_t>(bits));
    return stream;
  };
  EXPECT_TRUE(is_refused(block(1 | 1 << 3 | 1 << 6 | 1 << 9), 10)) << "four of one bit";
  EXPECT_TRUE(is_refused(block(2 << 9 | 2 << 6), 10)) << "two of two bits alone";
  EXPECT_TRUE(is_refused(block(0), 10)) << "none";
  EXPECT_TRUE(is_refused({0x78, 0x01, 0x07, 0, 0, 0, 0, 0, 0, 0}, 0)) << "a kind of block that there is not";
  EXPECT_TRUE(is_refused({0x78, 0x20, 3, 0, 0, 0, 0, 1}, 0)) << "a dictionary";
  EXPECT_FALSE(is_refused({0x78, 0x01, 3, 0, 0, 0, 0, 1}, 0)) << "nothing at all";
  EXPECT_TRUE(is_refused({}, 0));
}

}  // namespace
}  // namespace esim
