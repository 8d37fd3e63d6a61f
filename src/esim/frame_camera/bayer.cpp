#include "esim/frame_camera/bayer.h"

namespace esim::inline frame_camera {

void mosaic(const Image<float>& red, const Image<float>& green, const Image<float>& blue, Image<float>& out) {
  out = green;
  for (int y = 0; y < out.height(); ++y) {
    const Image<float>& other = y % 2 == 0 ? red : blue;
    for (int x = y % 2; x < out.width(); x += 2) out(x, y) = other(x, y);
  }
}

}  // namespace esim::inline frame_camera
