#pragma once

#include <string>

#include "esim/core/image.h"
#include "esim/record/preview/colours.h"

namespace esim {

/// How a terminal is told colours.
enum class TerminalColours {
  direct,   ///< by 24 bits
  indexed,  ///< of 256: a cube of 6 x 6 x 6 and 24 greys
};

/// An image as text: each character shows two pixels, one above the other, as the upper half block in the upper one's
/// colour on the lower one's. Lines end with the colours reset, "\r\n" between them. Below an odd last row is black.
std::string half_blocks(const Image<Rgb>& image, TerminalColours colours);

/// The nearest of the colours 16 to 255 of terminals with 256.
int indexed_colour(Rgb colour);

}  // namespace esim
