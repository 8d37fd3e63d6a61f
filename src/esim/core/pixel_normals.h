#pragma once

#include <array>
#include <cstdint>

#include "esim/core/per_pixel.h"
#include "esim/core/random.h"

namespace esim::inline core {

/// Four standard normal deviates for the next draw of each pixel of a block: Box-Muller on the 32-bit words of
/// AddressedRandom::bits(pixel, draw), in floats. The deviates of a pixel do not depend on other pixels.
class PixelNormals {
 public:
  /// Draws for `count` pixels, the i-th of which has draws[i] earlier draws.
  void draw(const AddressedRandom& random, std::size_t count, const PerPixel<std::uint32_t>& pixel,
            const PerPixel<std::uint32_t>& draws);

  /// The k-th of the four deviates of each pixel.
  const PerPixel<float>& operator[](std::size_t k) const { return normals_[k]; }

 private:
  std::array<PerPixel<std::uint32_t>, 4> words_;
  std::array<PerPixel<float>, 4> normals_;
};

}  // namespace esim::inline core
