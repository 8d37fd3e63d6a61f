// Compares with a separate encoder, which filters as in the standard and does not compress.
#include "esim/files/png_pixels.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

namespace esim {
namespace {

using Bytes = std::vector<std::uint8_t>;

void append_number(Bytes& out, std::uint32_t number) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<std::uint8_t>(number >> shift));
}

void append_chunk(Bytes& out, const std::string& name, const Bytes& data) {
  append_number(out, static_cast<std::uint32_t>(data.size()));
  const std::size_t begin = out.size();
  out.insert(out.end(), name.begin(), name.end());
  out.insert(out.end(), data.begin(), data.end());
  std::uint32_t crc = ~0U;
  for (std::size_t i = begin; i < out.size(); ++i) {
    crc ^= out[i];
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (0xEDB88320U & (0U - (crc & 1U)));
  }
  append_number(out, ~crc);
}

/// A zlib stream of stored blocks.
Bytes stored(const Bytes& data) {
  Bytes out = {0x78, 0x01};
  std::uint32_t a = 1, b = 0;
  for (const std::uint8_t byte : data) a = (a + byte) % 65521, b = (b + a) % 65521;
  constexpr std::size_t kMax = 65535;
  for (std::size_t at = 0; at < data.size(); at += kMax) {
    const std::size_t size = std::min(kMax, data.size() - at);
    out.push_back(at + size == data.size() ? 1 : 0);
    for (const std::size_t number : {size, ~size}) {
      out.push_back(static_cast<std::uint8_t>(number));
      out.push_back(static_cast<std::uint8_t>(number >> 8));
    }
    out.insert(out.end(), data.begin() + static_cast<std::ptrdiff_t>(at),
               data.begin() + static_cast<std::ptrdiff_t>(at + size));
  }
  append_number(out, b << 16 | a);
  return out;
}

int predictor(int filter, int left, int above, int corner) {
  const int estimate = left + above - corner;
  const int to_left = std::abs(estimate - left), to_above = std::abs(estimate - above),
            to_corner = std::abs(estimate - corner);
  switch (filter) {
    case 1:
      return left;
    case 2:
      return above;
    case 3:
      return (left + above) / 2;
    case 4:
      return to_left <= to_above && to_left <= to_corner ? left : to_above <= to_corner ? above : corner;
    default:
      return 0;
  }
}

struct Picture {
  int width = 0, height = 0, channels = 0, bits = 0;
  Bytes bytes{};  ///< as in the file: 16-bit numbers have the higher byte first

  std::size_t pixel_bytes() const { return static_cast<std::size_t>(channels * bits / 8); }
  std::size_t row_bytes() const { return static_cast<std::size_t>(width) * pixel_bytes(); }
};

/// Smooth with jumps, so that carries and ties of every filter occur.
Picture picture_of(int width, int height, int channels, int bits) {
  Picture picture{width, height, channels, bits};
  std::uint32_t noise = 7;
  for (std::size_t i = 0; i < picture.row_bytes() * static_cast<std::size_t>(height); ++i) {
    noise = 1664525 * noise + 1013904223;
    picture.bytes.push_back(static_cast<std::uint8_t>(noise >> 30 == 0 ? noise >> 20 : 3 * i));
  }
  return picture;
}

Bytes head_of(const Picture& picture, std::uint32_t width, std::uint32_t height, std::uint8_t interlaced = 0) {
  const std::uint8_t kinds[] = {0, 4, 2, 6};
  Bytes head;
  append_number(head, width);
  append_number(head, height);
  for (const std::uint8_t byte : {static_cast<std::uint8_t>(picture.bits), kinds[picture.channels - 1], std::uint8_t{0},
                                  std::uint8_t{0}, interlaced})
    head.push_back(byte);
  return head;
}

/// Encodes with one filter for all rows, or with each in turn (-1), and the data in several chunks.
Bytes encode(const Picture& picture, int filter, std::size_t chunks = 1) {
  Bytes rows;
  const std::size_t row = picture.row_bytes(), step = picture.pixel_bytes();
  for (std::size_t y = 0; y < static_cast<std::size_t>(picture.height); ++y) {
    const int used = filter < 0 ? static_cast<int>(y % 5) : filter;
    rows.push_back(static_cast<std::uint8_t>(used));
    for (std::size_t x = 0; x < row; ++x) {
      const auto at = [&](bool left, bool up) {
        return (left && x < step) || (up && y == 0) ? 0 : picture.bytes[(y - up) * row + x - (left ? step : 0)];
      };
      rows.push_back(static_cast<std::uint8_t>(picture.bytes[y * row + x] -
                                               predictor(used, at(true, false), at(false, true), at(true, true))));
    }
  }
  const Bytes data = stored(rows);
  Bytes file = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  append_chunk(file, "IHDR",
               head_of(picture, static_cast<std::uint32_t>(picture.width), static_cast<std::uint32_t>(picture.height)));
  append_chunk(file, "tEXt", {'a', 0, 'b'});
  for (std::size_t i = 0; i < chunks; ++i) {
    const auto cut = [&](std::size_t k) {
      return data.begin() + static_cast<std::ptrdiff_t>(data.size() * k / chunks);
    };
    append_chunk(file, "IDAT", Bytes(cut(i), cut(i + 1)));
  }
  append_chunk(file, "IEND", {});
  return file;
}

bool decode(const Bytes& file, ImagePixels& pixels) {
  return decode_png_pixels({reinterpret_cast<const std::byte*>(file.data()), file.size()}, pixels);
}

TEST(PngPixels, EveryKindAndFilter) {
  ImagePixels pixels;  // reused for all images
  for (const int channels : {1, 2, 3, 4}) {
    for (const int bits : {8, 16}) {
      for (const int filter : {0, 1, 2, 3, 4, -1}) {
        const Picture picture = picture_of(37, 12, channels, bits);
        ASSERT_TRUE(decode(encode(picture, filter), pixels)) << channels << " x " << bits << ", filter " << filter;
        EXPECT_EQ(pixels.width, 37);
        EXPECT_EQ(pixels.height, 12);
        EXPECT_EQ(pixels.channels, channels);
        EXPECT_EQ(pixels.bits, bits);
        ASSERT_EQ(pixels.bytes.size(), picture.bytes.size());
        for (std::size_t i = 0; i < picture.bytes.size(); ++i) {
          const int expected =
              bits == 8 ? picture.bytes[i] : picture.bytes[i & ~std::size_t{1}] << 8 | picture.bytes[i | 1];
          const int found =
              bits == 8 ? pixels.bytes[i] : reinterpret_cast<const std::uint16_t*>(pixels.bytes.data())[i / 2];
          ASSERT_EQ(found, expected) << "byte " << i << " of " << channels << " x " << bits << ", filter " << filter;
        }
      }
    }
  }
}

TEST(PngPixels, OnePixelAndManyChunks) {
  ImagePixels pixels;
  const Picture one = picture_of(1, 1, 3, 8), large = picture_of(200, 150, 4, 8);
  ASSERT_TRUE(decode(encode(one, 4), pixels));
  EXPECT_EQ(pixels.bytes, one.bytes);
  ASSERT_TRUE(decode(encode(large, -1, 7), pixels));
  EXPECT_EQ(pixels.bytes, large.bytes);
}

TEST(PngPixels, DamageIsFoundWhereverItIs) {
  const Bytes file = encode(picture_of(5, 4, 3, 8), -1, 2);
  ImagePixels pixels;
  ASSERT_TRUE(decode(file, pixels));
  for (std::size_t i = 0; i < file.size(); ++i) {
    EXPECT_FALSE(decode(Bytes(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(i)), pixels)) << "cut at " << i;
    for (const int change : {0x01, 0x80, 0xFF}) {
      Bytes damaged = file;
      damaged[i] = static_cast<std::uint8_t>(damaged[i] ^ change);
      EXPECT_FALSE(decode(damaged, pixels)) << "byte " << i << " changed by " << change;
    }
  }
}

TEST(PngPixels, OtherKindsAreLeftToOthers) {
  const Picture picture = picture_of(5, 4, 3, 8);
  ImagePixels pixels;
  const auto with_head = [&](const Bytes& head, const std::string& extra = "") {
    Bytes file = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
    append_chunk(file, "IHDR", head);
    if (!extra.empty()) append_chunk(file, extra, {0, 0, 0, 0, 0, 0});
    append_chunk(file, "IDAT", stored(Bytes(4 * 16)));
    append_chunk(file, "IEND", {});
    return file;
  };
  EXPECT_TRUE(decode(with_head(head_of(picture, 5, 4)), pixels));
  EXPECT_FALSE(decode(with_head(head_of(picture, 5, 4), "tRNS"), pixels));
  EXPECT_FALSE(decode(with_head(head_of(picture, 5, 4, 1)), pixels)) << "interlaced";
  Bytes palette = head_of(picture, 5, 4);
  palette[9] = 3;
  EXPECT_FALSE(decode(with_head(palette), pixels));

  // Sizes that do not match the data: too small, too large, and larger than memory.
  EXPECT_FALSE(decode(with_head(head_of(picture, 5, 3)), pixels));
  EXPECT_FALSE(decode(with_head(head_of(picture, 5, 5)), pixels));
  EXPECT_FALSE(decode(with_head(head_of(picture, 1 << 20, 1 << 20)), pixels));
  EXPECT_FALSE(decode(with_head(head_of(picture, 0, 4)), pixels));
}

}  // namespace
}  // namespace esim
