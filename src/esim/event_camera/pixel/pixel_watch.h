// Accelerates (6): finds the pixels for which next_event() in reference.cpp may return an event.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "esim/event_camera/pixel/pixel_array.h"
#include "esim/render/sample.h"

// Private to event_camera.
namespace esim::inline event_camera {

/// Finds the pixels of some rows that become active: whose irradiance leaves its bounds, or whose timer expires.
/// Keeps its working memory.
class PixelWatch {
 public:
  /// Checks rows of the segment without changing the pixels. False if an irradiance is not a finite number >= 0.
  bool look(const PixelArray& pixels, const Segment& segment, Rows rows);

  /// The columns of the row's active pixels.
  std::span<const std::uint32_t> columns(int y) const {
    const std::size_t row = static_cast<std::size_t>(y - first_);
    return std::span(columns_).subspan(ends_[row], ends_[row + 1] - ends_[row]);
  }

  /// The number of active pixels in all rows.
  std::size_t count() const { return ends_.back(); }

 private:
  bool look_at_row(const PixelArray& pixels, const Segment& segment, int y, std::size_t& count);

  int first_ = 0;
  std::vector<std::uint32_t> columns_;
  std::vector<std::size_t> ends_ = {0};  // end of each previous row
};

}  // namespace esim::inline event_camera
