#pragma once

#include <string>

#include "esim/core/image.h"
#include "esim/scene/mesh.h"
#include "esim/scene/planes.h"

namespace esim::studio {

/// An image file that all browsers show in the same way as esim.
struct PageImage {
  std::string type;  ///< "image/jpeg" or "image/png"
  std::string bytes;
};

/// The file itself if it is of such a type and at most 2048 px wide and high; otherwise a converted image. Throws
/// UserError if it cannot be decoded.
PageImage page_image(const CodedTexture& texture);

/// A small version of an image.
struct Thumbnail {
  std::string jpeg;
  bool whole = false;  ///< whether it has the full size of the image
};

/// An image whose longer side has about `longest` px. Throws UserError if the image cannot be decoded.
Thumbnail thumbnail(const CodedTexture& texture, int longest);

/// Converts one plane or three to sRGB of at most `longest` px; values above white are clipped.
std::string make_jpeg(const Planes& linear, int longest);

/// Light for a browser that keeps values above white.
struct PageLight {
  int width = 0, height = 0;
  std::string halves;  ///< R, G and B of each pixel, row by row from the top: IEEE 754 half precision, little-endian
};

/// Reduces one plane or three to at most `longest` px. Values outside 0 to 65504 are clipped.
PageLight page_light(const Planes& linear, int longest);

}  // namespace esim::studio
