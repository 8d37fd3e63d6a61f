#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/time.h"

namespace esim::inline truth {

/// Which object each pixel saw, by the samples of a camera: between two samples of a pixel, that of the nearer one.
class SeenObjects {
 public:
  SeenObjects(int width, int height);

  /// Adds the objects that tiles of a sample show at `t`, 0 for none. The samples of a pixel must come in order of
  /// time; earlier ones are ignored. Nothing, if the image is empty.
  void add(const Image<std::uint16_t>& object, TimeNs t, std::span<const Tile> tiles);

  /// The object that a pixel saw; before its first sample, that of the first, and after the last, that of the last.
  std::uint16_t at(int x, int y, TimeNs t) const;

  /// Whether so much is known that it is time to forget some of it.
  bool is_long() const { return changes_ > limit_; }
  /// Makes at() undefined for earlier times.
  void forget_before(TimeNs t);

  /// The state, for core/state_archive.h.
  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    archive.objects(self.pixels_, [](auto& a, auto& pixel) {
      a.value(pixel.last);
      a.list(pixel.changes);
    });
    archive.value(self.changes_);
    archive.value(self.limit_);
  }

 private:
  struct Change {
    TimeNs from = 0;
    std::uint16_t object = 0;
  };
  struct Pixel {
    TimeNs last = std::numeric_limits<TimeNs>::min();  // time of the last sample
    std::vector<Change> changes;                       // what it saw from when on; none: 0
  };

  int width_;
  std::vector<Pixel> pixels_;
  std::size_t changes_ = 0, limit_ = std::size_t{1} << 20;
};

}  // namespace esim::inline truth
