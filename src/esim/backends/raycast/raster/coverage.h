#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "esim/backends/raycast/raster/cell_surfaces.h"
#include "esim/backends/raycast/raster/convex.h"

// Private to backends/raycast.
namespace esim::inline backends::inline raycast {

/// Smaller parts of a pixel are ignored.
inline constexpr float kSmallestArea = 2e-5F;

/// Variances and covariance of the positions in an area. The defaults are those of a complete pixel.
struct Spread {
  float ss = 1.0F / 12, st = 0, tt = 1.0F / 12;
};

/// The visible part of a triangle in a pixel.
struct Fragment {
  std::uint32_t triangle;  ///< of the cell's
  std::uint16_t pixel;     ///< of the cell
  PixelPoint centroid;
  Spread spread;
  float area;               ///< fraction of the pixel
  std::uint64_t samples{};  ///< a bit for each position at which it is visible, if requested
};

/// What is seen in the middle of a pixel.
struct SeenInMiddle {
  float inverse_depth = 0;  ///< 0: nothing
  std::uint32_t group = 0;
  std::uint32_t triangle = 0;  ///< of the cell's
};

/// Divides a pixel among the triangles that are visible in it.
class Coverage {
 public:
  /// More triangles are tested at sample positions.
  static constexpr std::size_t kMaxExact = 24;

  /// `places` of samples in a pixel, at most 64. `store_samples`: of fragments.
  Coverage(std::span<const Eigen::Vector2f> places, bool store_samples);

  /// Appends the fragments of a pixel. The sum of their areas is 1 if no background is visible. Areas are exact if
  /// there are few candidates and several samples, and multiples of 1 / samples otherwise.
  SeenInMiddle divide(const CellSurfaces& surfaces, const ImageCell& cell, int pixel, std::vector<Fragment>& fragments);

  std::span<const PixelPoint> samples() const { return samples_; }

 private:
  /// A candidate in the pixel's coordinates.
  struct Local {
    // Its weights and its inverse depth as functions of the position, and half of the ranges of their values.
    alignas(16) std::array<float, 4> middle, s, t, reach;
    float nearest, farthest;  // bounds of the inverse depth in the pixel
    bool outside;             // of the pixel
    unsigned crossing;        // a bit for each weight that is not positive in the whole pixel
    std::uint32_t triangle, group, index;

    OfPixel function(std::size_t k) const { return {middle[k], s[k], t[k]}; }
    OfPixel inverse_depth() const { return function(3); }
  };

  const Candidate& found(std::size_t candidate) const { return found_[order_[candidate] & 0xffffffffU]; }
  float nearest(std::size_t candidate) const;
  const Local& local(std::size_t candidate);
  SeenInMiddle look_at_middle();
  bool divide_exactly(std::vector<Fragment>& fragments);
  bool take(Convex& piece, std::size_t candidate);
  static bool is_apart(const Convex& piece, const Local& surface);
  static bool keep_covered(Convex& piece, const Local& surface, std::vector<Convex>& rests);
  bool hide(const Local& surface, const Local& other);
  void look_at_samples();
  void divide_by_samples(std::vector<Fragment>& fragments);
  void store_samples(std::span<Fragment> fragments);

  static constexpr std::size_t kMaxSamples = 64;
  static constexpr std::uint32_t kNone = ~0U;

  std::vector<PixelPoint> samples_;
  bool store_samples_;
  std::uint64_t every_sample_;
  alignas(64) std::array<float, kMaxSamples> s_, t_;
  std::array<std::uint32_t, kMaxSamples> seen_;  // the candidate that is visible at each sample
  // Of the current pixel.
  const CellSurfaces* surfaces_;
  const ImageCell* cell_;
  std::uint16_t pixel_;
  std::span<const Candidate> found_;
  std::vector<std::uint64_t> order_;  // the nearest first: inverse depth, and the place in found_
  std::vector<Local> candidates_;     // the first of these
  std::vector<Convex> left_;          // of the pixel, for the next candidate
  std::vector<Convex> visible_;       // what a candidate takes of a piece
  std::vector<Convex> remaining_;     // what it leaves
};

}  // namespace esim::inline backends::inline raycast
