#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "esim/core/image.h"

namespace esim::inline plot {

/// A line of text as the coverage of pixels.
struct TextMask {
  Image<std::uint8_t> coverage;  ///< 0 to 255
  int left = 0, top = 0;         ///< position of its first pixel relative to the beginning of the baseline
  int width = 0;                 ///< from the beginning of the text to its end, px

  /// The same, turned counterclockwise: it reads from the bottom to the top.
  TextMask turned() const;
};

/// A line of UTF-8 text in DejaVu Sans, which is part of the program; capitals are `height` px tall. Invalid bytes are
/// drawn as replacement characters. Each thread caches the latest lines. The reference is valid until the thread's next
/// call.
const TextMask& draw_text(std::string_view line, int height);

/// The number as Unicode's superscripts: "⁻³".
std::string superscript(int number);

}  // namespace esim::inline plot
