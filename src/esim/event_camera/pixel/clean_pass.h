// Accelerates next_event() in reference.cpp, only (6) and `hold` of (11), for a block of pixels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "esim/event_camera/pixel/pixel_array.h"
#include "esim/event_camera/pixel/pixel_watch.h"
#include "esim/events/packed_events.h"
#include "esim/render/sample.h"

// Private to event_camera.
namespace esim::inline event_camera {

/// Advances the active pixels through a segment if only changes of irradiance make pixels fire and their bounds are of
/// irradiance: as PixelPass, but in whole vectors and without branches. Keeps its working memory.
class CleanPass {
 public:
  CleanPass();
  ~CleanPass();
  CleanPass(CleanPass&&) noexcept;
  CleanPass& operator=(CleanPass&&) noexcept;

  /// Sets the references of neighbouring pixels, from `first` on, at their first sample.
  void open(PixelArray& pixels, std::uint32_t first, std::span<const double> brightness);

  /// Advances the active pixels that `watch` found in rows of the segment.
  void run(PixelArray& pixels, const Segment& segment, const PixelWatch& watch, Rows rows, PackedEvents& events);

  /// Lets pixels that are held in reset resume in the segment, up to their next event. Pixels that fire then wait in
  /// reset.
  void resume(PixelArray& pixels, const Segment& segment, std::span<const std::uint32_t> which, PackedEvents& events);

 private:
  struct Block;
  void run_block(PixelArray& pixels, const Segment& segment, PackedEvents& events, bool wait = false);

  std::unique_ptr<Block> block_;  // small enough for the first level of cache
};

}  // namespace esim::inline event_camera
