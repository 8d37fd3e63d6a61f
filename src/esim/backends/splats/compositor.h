#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "esim/backends/splats/lanes.h"
#include "esim/backends/splats/projected_cluster.h"

// Private to backends/splats: includes hwy/highway.h.
namespace esim::inline backends::inline splats {

/// A block of 4 x (kLanes / 4) pixels, a lane each.
inline constexpr int kBlockWidth = 4, kBlockHeight = kLanes / kBlockWidth;

/// Blends the splats of a square of pixels, a bin, from front to back. Bins lie on a lattice from the image's corner.
class Compositor {
 public:
  static constexpr int kSide = 16;  ///< of a bin, px

  /// `grey`: only the first colour is blended.
  explicit Compositor(bool grey = false) : grey_(grey) {}

  /// Begins the bin whose first pixel is (left, top).
  void start(int left, int top);

  /// Hides what lies behind a surface in a pixel of the bin; `nearness`: its inverse depth, 1/m.
  void set_surface(int column, int row, float nearness);

  /// Adds a splat that may be visible in these columns and rows of the image. Splats with smaller `order` are in front;
  /// it must be positive.
  void add(const ScreenSplat& splat, float order, int left, int right, int top, int bottom);

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

  void sort();
  template <bool kGrey>
  void blend_all();
  template <bool kGrey>
  void add_to_block(const ScreenSplat& splat, float x, float y, Block& block);

  bool grey_;
  int left_ = 0, top_ = 0;
  bool surfaces_ = false;
  std::vector<Listed> splats_, sorted_;
  std::array<Block, static_cast<std::size_t>(kColumns* kRows)> blocks_;
  int finished_ = 0;
};

}  // namespace esim::inline backends::inline splats
