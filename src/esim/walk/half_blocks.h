#pragma once

#include <string>

#include "esim/core/image.h"
#include "esim/preview/colours.h"

namespace esim::inline walk {

/// How colours are sent to a terminal.
enum class TerminalColours {
  direct,   ///< as 24 bits
  indexed,  ///< as one of 256: a cube of 6 x 6 x 6 and 24 greys
};

/// An image as text: each character shows two pixels, one above the other, as an upper half block with the upper
/// pixel's colour on the lower pixel's. Each line ends with a colour reset; "\r\n" separates lines. An odd last row has
/// black below it.
std::string half_blocks(const Image<Rgb>& image, TerminalColours colours);

/// The nearest of the colours 16 to 255 of a terminal with 256 colours.
int indexed_colour(Rgb colour);

}  // namespace esim::inline walk
