#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "esim/backends/splats/lanes.h"
#include "esim/backends/splats/projected_cluster.h"
#include "esim/backends/splats/splat_renderer.h"

// Private to backends/splats: includes hwy/highway.h.
namespace esim::inline backends::inline splats {

/// A block of 4 x (kLanes / 4) pixels, a lane each.
inline constexpr int kBlockWidth = 4, kBlockHeight = kLanes / kBlockWidth;

/// Pixels that are composited together, on a lattice from the image's corner.
struct Bin {
  static constexpr int kSide = 16;
  static constexpr int kColumns = kSide / kBlockWidth, kRows = kSide / kBlockHeight, kBlocks = kColumns * kRows;
};

/// Composites the splats of a bin from front to back.
class Compositor {
 public:
  using Values = std::array<float, Bin::kSide * Bin::kSide>;  ///< of a bin's pixels, row-major

  explicit Compositor(SplatOrder order) : order_(order) {}

  /// Begins a bin whose first pixel is (left, top).
  void start(int left, int top);

  /// Limits the splats of the pixel to those in front of a surface; `nearness`: its inverse depth, 1/m.
  void set_surface(int column, int row, float nearness);

  /// Adds a splat, in any order, that may be visible in these columns and rows of the image.
  void add(const ScreenSplat& splat, int left, int right, int top, int bottom);

  /// Composites the splats of the bin.
  void composite();

  /// Results for a pixel of the bin: colours before the background, transmittance, the inverse depth at which half
  /// of the light is blocked (0: nowhere), and the object that is there, as ScreenSplat::object.
  struct Pixel {
    std::array<float, 3> colour;
    float transmittance, nearness, object;
  };
  Pixel pixel(int column, int row) const;

 private:
  static constexpr std::size_t kWaiting = 8;
  using Row = std::array<float, static_cast<std::size_t>(kLanes)>;

  /// A contribution of each lane; its opacity is 0 for lanes that the splat does not reach.
  struct alignas(32) Contribution {
    Row nearness, opacity, red, green, blue, object;
  };

  /// The state of a block of pixels. Contributions wait in a ring, the nearest first, since those that come later may
  /// be nearer; the list of splats is in order for the middle of the bin only.
  struct alignas(32) Block {
    Row red, green, blue, transmittance, half_nearness, half_object, surface;
    std::array<Contribution, kWaiting> waiting;
    std::uint8_t first, count;
    bool finished;
  };

  float key_of(const ScreenSplat& splat) const;
  void sort();
  void add_to_block(const ScreenSplat& splat, float x, float y, Block& block);
  void wait(Block& block, const ScreenSplat& splat, Lanes opacity, Lanes nearness);
  void take(Block& block, const Contribution& contribution);

  /// A splat and the blocks that it may reach.
  struct Listed {
    float key;
    std::uint8_t first_column, last_column, first_row, last_row;
    const ScreenSplat* splat;
  };

  SplatOrder order_;
  int left_ = 0, top_ = 0;
  std::vector<Listed> splats_, sorted_;
  std::array<Block, Bin::kBlocks> blocks_;
  int finished_ = 0;
};

}  // namespace esim::inline backends::inline splats
