#include "esim/walk/half_blocks.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <optional>

namespace esim::inline walk {
namespace {

constexpr std::array<int, 6> kCubeLevels{0, 95, 135, 175, 215, 255};
constexpr int kFirstOfCube = 16, kFirstGrey = 232, kGreys = 24;

int nearest_level(int value) {
  int best = 0;
  for (int i = 1; i < 6; ++i) {
    if (std::abs(kCubeLevels[i] - value) < std::abs(kCubeLevels[best] - value)) best = i;
  }
  return best;
}

int distance(Rgb a, int r, int g, int b) {
  const int dr = a.r - r, dg = a.g - g, db = a.b - b;
  return dr * dr + dg * dg + db * db;
}

/// The escape sequence that sets the foreground (38) or background (48) colour.
std::string set_colour(int which, Rgb colour, TerminalColours colours) {
  if (colours == TerminalColours::indexed) return fmt::format("\033[{};5;{}m", which, indexed_colour(colour));
  return fmt::format("\033[{};2;{};{};{}m", which, colour.r, colour.g, colour.b);
}

}  // namespace

int indexed_colour(Rgb colour) {
  const int r = nearest_level(colour.r), g = nearest_level(colour.g), b = nearest_level(colour.b);
  const int mean = (colour.r + colour.g + colour.b) / 3;
  const int grey = std::clamp((mean - 3) / 10, 0, kGreys - 1), level = 8 + 10 * grey;
  if (distance(colour, level, level, level) < distance(colour, kCubeLevels[r], kCubeLevels[g], kCubeLevels[b]))
    return kFirstGrey + grey;
  return kFirstOfCube + 36 * r + 6 * g + b;
}

std::string half_blocks(const Image<Rgb>& image, TerminalColours colours) {
  std::string text;
  for (int y = 0; y < image.height(); y += 2) {
    if (y > 0) text += "\r\n";
    std::optional<Rgb> above, below;  // as they are set
    for (int x = 0; x < image.width(); ++x) {
      const Rgb upper = image(x, y), lower = y + 1 < image.height() ? image(x, y + 1) : Rgb{};
      if (above != upper) text += set_colour(38, upper, colours);
      if (below != lower) text += set_colour(48, lower, colours);
      above = upper, below = lower;
      text += "\u2580";
    }
    text += "\033[0m";
  }
  return text;
}

}  // namespace esim::inline walk
