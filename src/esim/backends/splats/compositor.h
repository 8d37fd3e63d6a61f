#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "esim/backends/splats/lanes.h"
#include "esim/backends/splats/projected_cluster.h"
#include "esim/backends/splats/ray_window.h"
#include "esim/scene/splats/splats.h"

// Private to backends/splats: includes hwy/highway.h.
namespace esim::inline backends::inline splats {

/// A block of 4 x (kLanes / 4) pixels, a lane each.
inline constexpr int kBlockWidth = 4, kBlockHeight = kLanes / kBlockWidth;

/// Blends the splats of a square of pixels, a bin, from front to back. Bins lie on a lattice from the image's corner.
///
/// In the order `ray`, the list of the bin is sorted by the depth in its middle only. A splat waits in the window of
/// each block until no later one of the list can be in front of it anywhere in the bin.
class Compositor {
 public:
  static constexpr int kSide = 16;  ///< of a bin, px

  /// `grey`: only the first colour is blended.
  Compositor(SplatOrder order, bool grey) : order_(order), grey_(grey) {}

  /// Begins the bin whose first pixel is (left, top).
  void start(int left, int top);

  /// Hides what lies behind a surface in a pixel of the bin; `nearness`: its inverse depth, 1/m.
  void set_surface(int column, int row, float nearness);

  /// Adds a splat that may be visible in these columns and rows of the image.
  void add(const ScreenSplat& splat, int left, int right, int top, int bottom);

  /// Blends all splats of the bin.
  void blend();

  struct Pixel {
    std::array<float, 3> colour;  ///< without what is behind all splats
    float transmittance;
    float nearness;  ///< inverse depth at which half of the light is blocked, 1/m; 0: nowhere
    float object;    ///< there, as ScreenSplat::object
  };
  Pixel pixel(int column, int row) const;

 private:
  static constexpr int kColumns = kSide / kBlockWidth, kRows = kSide / kBlockHeight;
  using Row = std::array<float, static_cast<std::size_t>(kLanes)>;

  struct alignas(64) Block {
    Row transmittance, red, green, blue, nearness, object, surface;
    bool finished;
  };

  /// A splat and the blocks that it may reach.
  struct Listed {
    std::uint32_t order;  // the bits of a positive float, whose order is the same
    std::uint8_t first_column, last_column, first_row, last_row;
    const ScreenSplat* splat;
  };

  static std::size_t block_of(int column, int row) {
    return static_cast<std::size_t>(row / kBlockHeight * kColumns + column / kBlockWidth);
  }
  static std::size_t lane_of(int column, int row) {
    return static_cast<std::size_t>(row % kBlockHeight * kBlockWidth + column % kBlockWidth);
  }

  /// The pixels of a block, relative to the centre of a splat, and what the splat hides of the light behind it there.
  struct Overlap {
    Lanes dx, dy, opacity;
    bool any;
  };

  float order_of(const ScreenSplat& splat) const;
  void sort();
  template <class Body>
  void for_each_block(const Listed& listed, const Body& body);
  template <bool kGrey>
  void blend_all();
  template <bool kGrey>
  void blend_by_ray();
  template <bool kGrey>
  void blend_front(RayWindow& window, float bound, Block& block);
  void find_bounds();
  Overlap overlap(const ScreenSplat& splat, float x, float y, const Block& block) const;
  template <class Depth, class Object>
  void hide(Lanes weight, const Depth& depth, const Object& object, Block& block);

  SplatOrder order_;
  bool grey_;
  int left_ = 0, top_ = 0;
  bool surfaces_ = false;
  std::vector<Listed> splats_, sorted_;
  std::array<Block, static_cast<std::size_t>(kColumns* kRows)> blocks_;
  int finished_ = 0;

  // For the order `ray`
  std::vector<float> bounds_;  // per place in the list: the nearest that it and all later ones are, 1/m
  static constexpr int kFields = 5;
  std::vector<std::array<float, kFields>> colours_;  // per place: three colours, the object, what breaks ties
  std::array<RayWindow, static_cast<std::size_t>(kColumns* kRows)> windows_;  // per block
};

}  // namespace esim::inline backends::inline splats
