// Text, lines and axes: what they draw, and that it remains within its place.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <thread>

#include "esim/plot/axes.h"
#include "esim/plot/colour_bar.h"
#include "esim/plot/text.h"

namespace esim {
namespace {

constexpr Rgb kWhite{255, 255, 255}, kBlack{0, 0, 0};

/// The smallest tile with all pixels that are not `background`.
Tile drawn_part(const Image<Rgb>& image, Rgb background = kWhite) {
  int left = image.width(), right = -1, top = image.height(), bottom = -1;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      if (image(x, y) == background) continue;
      left = std::min(left, x);
      right = std::max(right, x);
      top = std::min(top, y);
      bottom = std::max(bottom, y);
    }
  }
  return right < 0 ? Tile{} : Tile{left, top, right + 1 - left, bottom + 1 - top};
}

double darkness(const Image<Rgb>& image) {
  double sum = 0;
  for (const Rgb& pixel : image.pixels()) sum += (255 - pixel.r) / 255.0;
  return sum;
}

TEST(Text, StandsOnTheBaselineAndCapitalsHaveTheHeight) {
  for (const int height : {8, 10, 12, 20, 50}) {
    Canvas canvas(400, 120, kWhite);
    const int width = canvas.text(10, 80, "HEL", height, kBlack);
    const Tile drawn = drawn_part(canvas.pixels());
    EXPECT_EQ(drawn.y + drawn.height, 80) << height;
    EXPECT_EQ(drawn.height, height);
    EXPECT_GE(drawn.x, 10);
    EXPECT_LE(drawn.x + drawn.width, 10 + width);
    EXPECT_GT(drawn.width, 0.8 * width);
  }
}

TEST(Text, HasTheGlyphsOfFiguresAndNotEmptyBoxes) {
  // Each of these is drawn, and none as the box of an unknown character.
  const auto image = [](const std::string& text) {
    Canvas canvas(60, 60, kWhite);
    canvas.text(20, 40, text, 20, kBlack);
    return std::move(canvas).take();
  };
  const Image<Rgb> box = image("\U000F1234");
  for (const std::string text :
       {"a", "0", "µ", "×", "−", "ε", "⁻", "⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹", "°", "é"}) {
    const Image<Rgb> drawn = image(text);
    EXPECT_GT(darkness(drawn), 2) << text;
    EXPECT_FALSE(std::equal(drawn.pixels().begin(), drawn.pixels().end(), box.pixels().begin())) << text;
  }
}

TEST(Text, IsTheSameEachTimeAndInEachThread) {
  const TextMask first = draw_text("t = 0.1 s", 12);
  for (int i = 0; i < 2000; ++i) EXPECT_GT(draw_text(std::to_string(i), 10).width, 0);
  std::vector<TextMask> others(4);
  std::vector<std::thread> threads;
  for (TextMask& other : others) threads.emplace_back([&other] { other = draw_text("t = 0.1 s", 12); });
  for (std::thread& thread : threads) thread.join();
  others.push_back(draw_text("t = 0.1 s", 12));
  for (const TextMask& other : others) {
    EXPECT_EQ(other.width, first.width);
    EXPECT_TRUE(std::equal(first.coverage.pixels().begin(), first.coverage.pixels().end(),
                           other.coverage.pixels().begin(), other.coverage.pixels().end()));
  }
  EXPECT_EQ(draw_text("", 10).width, 0);
  EXPECT_TRUE(draw_text("  ", 10).coverage.empty());
  EXPECT_LT(draw_text("text", 10).width, draw_text("text", 20).width);
}

TEST(Text, DrawsReplacementCharactersForInvalidBytes) {
  const TextMask replacement = draw_text("\uFFFD", 20);
  for (const std::string& invalid :
       {std::string("\xff"), std::string("\x80"), std::string("\xc3"), std::string("\0", 1)}) {
    const TextMask drawn = draw_text(invalid, 20);
    EXPECT_EQ(drawn.width, replacement.width);
    EXPECT_TRUE(std::equal(drawn.coverage.pixels().begin(), drawn.coverage.pixels().end(),
                           replacement.coverage.pixels().begin(), replacement.coverage.pixels().end()));
  }
  // Overlong, surrogate, too large, incomplete, and a noncharacter.
  for (const std::string invalid : {"\xc0\xaf", "\xed\xa0\x80", "\xf5\x80\x80\x80", "a\xe2\x82", "\xef\xbf\xbf"})
    EXPECT_GE(draw_text(invalid, 20).width, replacement.width);
  std::mt19937 random(3);
  for (int i = 0; i < 2000; ++i) {
    std::string bytes(random() % 12, ' ');
    for (char& byte : bytes) byte = static_cast<char>(random());
    EXPECT_NO_THROW(draw_text(bytes, 8)) << testing::PrintToString(bytes);
  }
  // Without kerning, the width is the sum of the advances, up to the rounding of each.
  int sum = 0;
  const std::vector<std::string> characters = {"a", "é", "−", "µ", "⁻", "⁶", "𝔸"};
  for (const std::string& character : characters) sum += draw_text(character, 20).width;
  EXPECT_NEAR(draw_text("aé−µ⁻⁶𝔸", 20).width, sum, static_cast<double>(characters.size()));
}

TEST(Text, AlignsAtItsBeginningMiddleAndEnd) {
  const auto drawn = [](Align align) {
    Canvas canvas(400, 60, kWhite);
    canvas.text(200, 40, "HHHHHH", 20, kBlack, align);
    return drawn_part(canvas.pixels());
  };
  const Tile left = drawn(Align::left), centre = drawn(Align::centre), right = drawn(Align::right);
  EXPECT_NEAR(left.x, 200, 4);
  EXPECT_NEAR(centre.x + 0.5 * centre.width, 200, 2);
  EXPECT_NEAR(right.x + right.width, 200, 4);
}

TEST(Text, TurnedIsTheTransposedImage) {
  Canvas level(200, 200, kWhite), turned(200, 200, kWhite);
  level.text(50, 100, "Lg", 20, kBlack);
  turned.vertical_text(100, 200 - 50, "Lg", 20, kBlack);
  for (int y = 0; y < 200; ++y) {
    for (int x = 0; x < 200; ++x) ASSERT_EQ(turned.pixels()(y, 199 - x), level.pixels()(x, y)) << x << " " << y;
  }
}

TEST(Lines, CoverTheirWidth) {
  for (const double width : {1.0, 2.0, 3.5}) {
    Canvas canvas(100, 100, kWhite);
    const std::vector<Spot> points = {{20, 50}, {80, 50}};
    const std::vector<Stroke> strokes = {{Spot{20, 20}, Spot{80, 80}}};
    canvas.strokes(strokes, width, kBlack);
    EXPECT_NEAR(darkness(canvas.pixels()), width * std::hypot(60, 60), 0.02 * width * 85 + 1);
    Canvas level(100, 100, kWhite);
    level.polyline(points, width, kBlack);
    constexpr double kEdge = 1.0 / 30;  // Cairo rounds edges to 1/15 px
    EXPECT_NEAR(darkness(level.pixels()), width * 60 + 0.25 * 3.1416 * width * width, 2 * kEdge * 60);
    EXPECT_EQ(level.pixels()(50, 50), kBlack);
  }
}

TEST(Lines, AreClippedAndInterrupted) {
  const double infinity = std::numeric_limits<double>::infinity(), nan = std::nan("");
  Canvas canvas(50, 40, kWhite);
  canvas.clip({10, 10, 20, 20});
  const std::vector<Spot> across = {{-1e12, 15}, {1e12, 15}, {25, 1e9}, {25, -1e9}};
  canvas.polyline(across, 3, kBlack);
  EXPECT_EQ(drawn_part(canvas.pixels()), (Tile{10, 10, 20, 20}));
  canvas.unclip();
  canvas.fill(canvas.pixels().bounds(), kWhite);
  const std::vector<Spot> broken = {{5, 5}, {15, 5}, {nan, 5}, {25, 5}, {35, 5}, {infinity, 5}};
  canvas.polyline(broken, 1, kBlack);
  EXPECT_EQ(canvas.pixels()(10, 5), kBlack);
  EXPECT_EQ(canvas.pixels()(20, 5), kWhite);
  EXPECT_EQ(canvas.pixels()(30, 5), kBlack);
  canvas.polyline({}, 1, kBlack);
  canvas.disc({nan, 3}, 2, kBlack);
  canvas.disc({1e30, -1e30}, 2, kBlack);
}

TEST(Discs, CoverTheirArea) {
  Canvas canvas(60, 60, kWhite);
  canvas.disc({30, 30}, 10, kBlack);
  EXPECT_NEAR(darkness(canvas.pixels()), 314.16, 3);
  EXPECT_EQ(drawn_part(canvas.pixels()), (Tile{20, 20, 21, 21}));
}

/// Scales of many sizes and kinds.
std::vector<std::pair<Scale, Scale>> scales() {
  return {{linear_scale(0, 1, "time (s)"), linear_scale(-1e6, 1e6, "rate (ev/s)", LabelStyle::magnitudes)},
          {linear_scale(1.6e9, 1.6e9 + 0.3, "time (s)"), linear_scale(1e-9, 2e-9, "a very small number (m)")},
          {logarithmic_scale(1e-6, 1e2, "interval", LabelStyle::seconds), logarithmic_scale(1, 1e12, "pixels")},
          {logarithmic_scale(1.1, 1.2, "narrow"), linear_scale(5, 5, "of a single value")},
          {linear_scale(-123456, -123400, "x"),
           name_scale(std::vector<std::string>{"adaptive tiles 0.05", "uniform 100 Hz", "a"})}};
}

TEST(AxesTest, EverythingIsWithinTheCell) {
  for (const auto& [x, y] : scales()) {
    for (const auto& [width, height] : {std::pair{900, 480}, {400, 300}, {320, 240}, {640, 200}}) {
      const Tile cell{40, 30, width, height};
      Canvas canvas(width + 80, height + 60, kWhite);
      Axes axes(canvas, cell, x, y, {"Title", {{"ON", kBlack}, {"OFF", kBlack, Mark::line}}});
      const std::vector<DataPoint> line = {{x.low, y.low}, {x.high, y.high}, {10 * x.high, 10 * y.high}, {-1, -1}};
      axes.line(line, kBlack, 3);
      axes.dot({x.low, y.low}, 5, kBlack);
      axes.vertical_line(x.high, "maximum", kBlack);
      axes.finish();
      const Tile drawn = drawn_part(canvas.pixels());
      EXPECT_GE(drawn.x, cell.x) << x.title << " " << width;
      EXPECT_GE(drawn.y, cell.y) << x.title << " " << width;
      EXPECT_LE(drawn.x + drawn.width, cell.x + cell.width) << x.title << " " << width;
      EXPECT_LE(drawn.y + drawn.height, cell.y + cell.height) << x.title << " " << height;
      EXPECT_GT(axes.area().width, width / 3);
      EXPECT_GT(axes.area().height, height / 3);
    }
  }
}

TEST(AxesTest, LabelsDoNotTouchEachOther) {
  for (const auto& [x, y] : scales()) {
    for (const int width : {900, 500, 300, 200}) {
      Canvas canvas(width, 300, kWhite);
      Axes axes(canvas, canvas.pixels().bounds(), x, y);
      axes.finish();
      // Labels are runs of columns with ink, between gaps that are wider than a space.
      const int top = axes.area().y + axes.area().height + 7;
      int labels = 0, empty = 1000;
      for (int column = 0; column < width; ++column) {
        bool ink = false;
        for (int row = top; row < top + 13; ++row) ink = ink || !(canvas.pixels()(column, row) == kWhite);
        labels += ink && empty > kTextHeight - 1 ? 1 : 0;
        empty = ink ? 0 : empty + 1;
      }
      const auto expected = std::count_if(axes.x_ticks().major.begin(), axes.x_ticks().major.end(),
                                          [](const Tick& tick) { return !tick.label.empty(); });
      EXPECT_EQ(labels, expected) << x.title << " " << width;
      EXPECT_GE(labels, axes.area().width >= 300 ? 3 : 1) << x.title << " " << width;
      EXPECT_LE(labels, 10) << x.title << " " << width;
    }
  }
}

TEST(AxesTest, TheLegendIsNextToTheTitleOrBelowIt) {
  constexpr Rgb kEntry{1, 2, 3};
  int below = 0;
  for (const auto& [x, y] : scales()) {
    for (int width = 260; width <= 900; width += 20) {
      Canvas canvas(width, 300, kWhite);
      const std::string title = "Event rate over time";
      const Axes axes(canvas, canvas.pixels().bounds(), x, y, {title, {{"ON", kEntry}, {"OFF", kEntry}}});
      Image<Rgb> entries(width, 300, kWhite);
      for (int i = 0; i < width * 300; ++i)
        if (canvas.pixels().pixels()[i] == kEntry) entries.pixels()[i] = kEntry;
      const Tile legend = drawn_part(entries);
      ASSERT_GT(legend.width, 0);
      EXPECT_LT(legend.y + legend.height, axes.area().y);
      const int title_end = axes.area().x + Canvas::text_width(title, kTitleHeight), title_bottom = 6 + kTitleHeight;
      EXPECT_TRUE(legend.x >= title_end + kTextHeight || legend.y > title_bottom) << x.title << " " << width;
      below += legend.y > title_bottom ? 1 : 0;
    }
  }
  EXPECT_GT(below, 5) << "both arrangements occur";
}

TEST(AxesTest, PlacesDataWhereTheTicksSayTheyAre) {
  Canvas canvas(600, 400, kWhite);
  Axes axes(canvas, canvas.pixels().bounds(), logarithmic_scale(1, 1000, ""), linear_scale(0, 10, ""));
  axes.dot({10, 5}, 4, kHighlightColour);
  axes.fill(100, 1000, 0, 2, kBarColour);
  const Tile area = axes.area();
  const auto x = [&](double decades) { return area.x + static_cast<int>(std::lround(decades / 3 * (area.width - 1))); };
  const auto y = [&](double value) {
    return area.y + static_cast<int>(std::lround((1 - value / 10) * (area.height - 1)));
  };
  EXPECT_EQ(canvas.pixels()(x(1), y(5)), kHighlightColour);
  EXPECT_EQ(canvas.pixels()(x(2) + 1, y(1)), kBarColour);
  EXPECT_NE(canvas.pixels()(x(2) - 2, y(1)), kBarColour);
  EXPECT_NE(canvas.pixels()(x(2.5), y(2) - 2), kBarColour);
}

TEST(ColourBar, ShowsTheColoursOfTheValuesAtItsTicks) {
  const auto colour_of = [](double value) { return value < 2 ? Rgb{0, 0, 250} : value < 5 ? Rgb{0, 250, 0} : kBlack; };
  for (const Direction direction : {Direction::horizontal, Direction::vertical}) {
    const bool is_horizontal = direction == Direction::horizontal;
    Canvas canvas(400, 400, kWhite);
    const Tile bar = is_horizontal ? Tile{50, 100, 300, 14} : Tile{100, 50, 14, 300};
    const Scale scale = logarithmic_scale(1, 10, "m");
    draw_colour_bar(canvas, bar, scale, direction, colour_of, kLightTheme);
    for (const double value : {1.01, 1.9, 2.1, 4.9, 5.1, 9.9}) {
      const int at = static_cast<int>(scale.position(value) * 300);
      EXPECT_EQ(canvas.pixels()(is_horizontal ? 50 + at : 107, is_horizontal ? 107 : 349 - at), colour_of(value))
          << value;
    }
    for (const double value : {2.0, 5.0}) {  // the ticks, next to the border of the colours
      const int at = static_cast<int>(std::lround(scale.position(value) * 299));
      EXPECT_EQ(canvas.pixels()(is_horizontal ? 50 + at : 117, is_horizontal ? 117 : 349 - at), kLightTheme.faint_ink);
    }
  }
}

TEST(Scales, ValueIsTheInverseOfPosition) {
  for (const auto& [x, y] : scales()) {
    for (const double position : {0.0, 0.25, 0.9, 1.0}) EXPECT_NEAR(x.position(x.value(position)), position, 1e-6);
  }
}

}  // namespace
}  // namespace esim
