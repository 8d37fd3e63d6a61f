#pragma once

#include <string>

#include "esim/core/image.h"
#include "esim/scene/mesh.h"
#include "esim/scene/planes.h"

namespace esim::studio {

/// An image file that every browser shows as esim does.
struct PageImage {
  std::string type;  ///< "image/jpeg" or "image/png"
  std::string bytes;
};

/// The file itself where it is such a one, at most 2048 px wide and high; else made from it. Throws UserError where it
/// cannot be decoded.
PageImage page_image(const CodedTexture& texture);

/// A small version of an image.
struct Thumbnail {
  std::string jpeg;
  bool whole = false;  ///< it is as large as the image
};

/// About `longest` px wide or high. Throws UserError where the image cannot be decoded.
Thumbnail thumbnail(const CodedTexture& texture, int longest);

/// sRGB, at most `longest` px wide and high; what is brighter than white is white. Of one plane or three.
std::string make_jpeg(const Planes& linear, int longest);

}  // namespace esim::studio
