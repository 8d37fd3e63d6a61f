#pragma once

#include <cstdint>
#include <vector>

#include "esim/render/sample.h"
#include "esim/sensors/pixel_array.h"

namespace esim {

/// The columns of each row in which a pixel woke up: its irradiance left the band, or its alarm went off. Private to
/// the event camera.
class PixelWatch {
 public:
  PixelWatch(int width, int height);

  /// Looks at a row of the segment, without changing anything. False where an irradiance is not a finite number >= 0.
  bool look(const PixelArray& pixels, const Segment& segment, int y);

  std::span<const std::uint32_t> columns(int y) const {
    return {columns_.data() + static_cast<std::size_t>(y) * stride_, counts_[static_cast<std::size_t>(y)]};
  }

 private:
  std::size_t stride_;
  std::vector<std::uint32_t> columns_;
  std::vector<std::uint32_t> counts_;
};

/// Throws UserError, naming the first pixel and the time, unless every irradiance of the tile is a finite number >= 0.
void check_irradiance(const Segment& segment);

}  // namespace esim
