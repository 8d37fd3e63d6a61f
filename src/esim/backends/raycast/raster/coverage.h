#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "esim/backends/raycast/raster/cell_surfaces.h"
#include "esim/backends/raycast/raster/clipped_triangles.h"
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
  std::uint64_t samples{};  ///< a bit for each sample for shadows at which it is visible, if requested
};

/// What is seen in the middle of a pixel.
struct SeenInMiddle {
  float inverse_depth = 0;  ///< 0: nothing
  std::uint32_t group = 0;
  std::uint32_t triangle = 0;  ///< of the cell's
};

/// Positions in a pixel.
struct PixelSamples {
  static constexpr std::size_t kMax = 64;

  /// 1, 16 or 64 of them; throws UserError otherwise.
  explicit PixelSamples(int samples_per_pixel);

  PixelPoint operator[](std::size_t i) const { return {s[i], t[i]}; }

  std::size_t count;
  std::uint64_t all;  ///< a bit for each of them
  alignas(64) std::array<float, kMax> s{}, t{};
};

/// The samples of Coverage.
struct CoverageSamples {
  /// `samples_per_pixel`: 1, 16 or 64; with 1, a pixel shows what its centre sees. Throws UserError otherwise.
  explicit CoverageSamples(int samples_per_pixel)
      : shadows(samples_per_pixel), visibility(samples_per_pixel == 1 ? 1 : PixelSamples::kMax) {}

  PixelSamples shadows;     ///< where shadows are tested
  PixelSamples visibility;  ///< where visibility is tested if many triangles may be visible
};

/// Divides a pixel among the triangles that are visible in it.
class Coverage {
 public:
  /// If there are more triangles, samples tell which of them are visible.
  static constexpr std::size_t kMaxExact = 8;

  /// `for_shadows`: fragments contain the samples for shadows.
  Coverage(const CoverageSamples& samples, bool for_shadows)
      : samples_(samples), dense_(samples.visibility), for_shadows_(for_shadows) {}

  /// Appends the fragments of a pixel. The sum of their areas is 1 if no background is visible. If there are many
  /// candidates, parts below 1/64 of the pixel may be missed; areas are exact for surfaces of which nothing is hidden,
  /// and for a single one behind them, and multiples of 1/64 for others.
  SeenInMiddle divide(const CellSurfaces& surfaces, const ImageCell& cell, int pixel, std::vector<Fragment>& fragments);

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

  /// What samples see of a candidate.
  struct Part {
    std::uint32_t candidate;
    std::uint64_t visible_at;  // these samples
    bool whole;                // all that it covers; without any, it lies between samples
    Moments moments;           // of what it covers, if it is whole
  };

  const Candidate& found(std::size_t candidate) const { return found_[order_[candidate] & 0xffffffffU]; }
  float nearest(std::size_t candidate) const;
  const Local& local(std::size_t candidate);
  void put_in_order();
  SeenInMiddle look_at_middle();
  bool divide_exactly(std::vector<Fragment>& fragments);
  bool take(Convex& piece, std::size_t candidate);
  static bool is_apart(const Convex& piece, const Local& surface);
  static bool keep_covered(Convex& piece, const Local& surface, std::vector<Convex>& rests);
  bool hide(const Local& surface, const Local& other);
  void look_at(const PixelSamples& samples);
  void divide_by_samples(std::vector<Fragment>& fragments);
  void clip_whole_parts(std::size_t first);
  void add_neighbours();
  Moments moments_of_samples(std::uint64_t samples) const;
  void store_samples(std::span<Fragment> fragments);

  const CoverageSamples& samples_;
  const PixelSamples& dense_;
  bool for_shadows_;
  // Of the current pixel.
  const CellSurfaces* surfaces_;
  const ImageCell* cell_;
  std::uint16_t pixel_;
  std::span<const Candidate> found_;
  std::vector<std::uint64_t> order_;                 // the nearest first: inverse depth, and the place in found_
  std::vector<Local> candidates_;                    // the first of these
  std::vector<std::uint64_t> covered_, visible_at_;  // samples in each of these, and samples that see it
  std::vector<Part> parts_;
  ClippedTriangles clipped_;
  std::vector<Convex> left_;       // of the pixel, for the next candidate
  std::vector<Convex> visible_;    // what a candidate takes of a piece
  std::vector<Convex> remaining_;  // what it leaves
};

}  // namespace esim::inline backends::inline raycast
