#pragma once

#include <cstdint>
#include <vector>

#include "esim/render/sample.h"
#include "esim/sensors/pixel_array.h"
#include "esim/sensors/pixel_watch.h"

namespace esim {

/// Takes the pixels that woke up in a segment through it, where nothing but the light makes them fire and their bands
/// are of irradiance: what PixelPass does, in whole vectors and without branches. Private to the event camera; holds
/// memory to work in.
class CleanPass {
 public:
  static bool serves(const PixelArray& pixels) {
    return !pixels.in_brightness && !pixels.alarmed && !pixels.renews && !pixels.delays &&
           (pixels.refractory == 0 || pixels.holds);
  }

  /// What `watch` found in rows of the segment.
  void run(PixelArray& pixels, const Segment& segment, const PixelWatch& watch, Rows rows, PackedEvents& events);

 private:
  void gather(PixelArray& pixels, const Segment& segment, const PixelWatch& watch, Rows rows,
              const EventPacking& packing);
  void resume(PixelArray& pixels, const Segment& segment);
  void find_crossings(double duration, double refractory);
  void report(PixelArray& pixels, TimeNs t0, double duration, PackedEvents& events);
  void set_bands(PixelArray& pixels);
  void make_room(std::size_t count);
  void move(std::size_t from, std::size_t to);

  // By pixel that is awake. Brightness is at the segment's ends; times are ns after its start.
  std::vector<double> before_, after_, on_, off_, reference_;
  std::vector<double> crossing_, polarity_, next_reference_, resumes_;
  std::vector<std::uint32_t> pixel_;
  std::vector<std::uint64_t> place_;
  std::size_t count_ = 0;

  // By pixel that is done: the levels that it sleeps between.
  std::vector<std::uint32_t> settled_;
  std::vector<float> low_, high_;
  std::size_t settled_count_ = 0;
};

}  // namespace esim
