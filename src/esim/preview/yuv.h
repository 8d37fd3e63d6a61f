#pragma once

#include <cstddef>
#include <cstdint>

#include "esim/core/image.h"
#include "esim/preview/colours.h"

namespace esim::inline preview {

/// A borrowed plane of bytes; `stride` is the distance between rows.
struct BytePlane {
  std::uint8_t* data = nullptr;
  std::ptrdiff_t stride = 0;
};

/// Converts to the input of video encoders: luma (16 to 235), and chroma (16 to 240, 128 is grey) as the mean of 2 x 2
/// pixels, by ITU-R BT.601. Width and height are even.
void to_yuv420(const Image<Rgb>& image, BytePlane y, BytePlane u, BytePlane v);

}  // namespace esim::inline preview
