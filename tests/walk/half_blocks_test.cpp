#include "esim/walk/half_blocks.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace esim {
namespace {

constexpr Rgb kRed{255, 0, 0}, kBlue{0, 0, 255};

TEST(HalfBlocks, ShowTwoPixelsPerCharacter) {
  Image<Rgb> image(2, 2, kRed);
  image(0, 1) = kBlue;
  EXPECT_EQ(half_blocks(image, TerminalColours::direct),
            "\033[38;2;255;0;0m\033[48;2;0;0;255m\u2580\033[48;2;255;0;0m\u2580\033[0m");
  EXPECT_EQ(half_blocks(image, TerminalColours::indexed),
            "\033[38;5;196m\033[48;5;21m\u2580\033[48;5;196m\u2580\033[0m");
}

TEST(HalfBlocks, EveryLineStandsForItself) {
  const std::string text = half_blocks(Image<Rgb>(3, 5, kRed), TerminalColours::direct);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 2);
  const std::string last = text.substr(text.rfind('\n') + 1);
  EXPECT_EQ(last, "\033[38;2;255;0;0m\033[48;2;0;0;0m\u2580\u2580\u2580\033[0m") << "black below the last row";
  EXPECT_EQ(half_blocks(Image<Rgb>(), TerminalColours::direct), "");
}

TEST(HalfBlocks, IndexedColoursAreTheNearest) {
  // The palette of terminals.
  const auto palette = [](int index) -> Rgb {
    const auto level = [](int i) { return static_cast<std::uint8_t>(i == 0 ? 0 : 55 + 40 * i); };
    if (index >= 232)
      return Rgb{static_cast<std::uint8_t>(8 + 10 * (index - 232)), static_cast<std::uint8_t>(8 + 10 * (index - 232)),
                 static_cast<std::uint8_t>(8 + 10 * (index - 232))};
    return Rgb{level((index - 16) / 36), level((index - 16) / 6 % 6), level((index - 16) % 6)};
  };
  const auto distance = [](Rgb a, Rgb b) {
    return (a.r - b.r) * (a.r - b.r) + (a.g - b.g) * (a.g - b.g) + (a.b - b.b) * (a.b - b.b);
  };
  for (int r = 0; r < 256; r += 15) {
    for (int g = 0; g < 256; g += 17) {
      for (int b = 0; b < 256; b += 15) {
        const Rgb colour{static_cast<std::uint8_t>(r), static_cast<std::uint8_t>(g), static_cast<std::uint8_t>(b)};
        int best = 1 << 30;
        for (int i = 16; i < 256; ++i) best = std::min(best, distance(colour, palette(i)));
        // Greys are chosen by the mean, which may differ by one step due to rounding.
        EXPECT_LE(distance(colour, palette(indexed_colour(colour))), best + 100) << r << ' ' << g << ' ' << b;
      }
    }
  }
}

}  // namespace
}  // namespace esim
