#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "esim/events/packed_events.h"
#include "esim/render/sample.h"
#include "esim/sensors/pixel_array.h"
#include "esim/sensors/pixel_watch.h"

namespace esim {

/// Takes the pixels that woke up in a segment through it, where nothing but the light makes them fire and their bands
/// are of irradiance: what PixelPass does, in whole vectors and without branches. Private to the event camera; holds
/// memory to work in.
class CleanPass {
 public:
  CleanPass();
  ~CleanPass();
  CleanPass(CleanPass&&) noexcept;
  CleanPass& operator=(CleanPass&&) noexcept;

  /// Sets the references of neighbouring pixels, from `first` on, that are seen for the first time.
  void open(PixelArray& pixels, std::uint32_t first, std::span<const double> brightness);

  /// What `watch` found in rows of the segment.
  void run(PixelArray& pixels, const Segment& segment, const PixelWatch& watch, Rows rows, PackedEvents& events);

  /// Lets pixels that are held in reset resume in the segment, and take their next event at most. Those that fire wait
  /// in reset.
  void resume(PixelArray& pixels, const Segment& segment, std::span<const std::uint32_t> which, PackedEvents& events);

 private:
  struct Block;
  void run_block(PixelArray& pixels, const Segment& segment, PackedEvents& events, bool wait = false);

  std::unique_ptr<Block> block_;  // small enough for the first level of cache
};

}  // namespace esim
