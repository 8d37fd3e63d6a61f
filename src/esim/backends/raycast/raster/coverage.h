#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "esim/backends/raycast/raster/cell_surfaces.h"
#include "esim/backends/raycast/raster/clipped_triangles.h"
#include "esim/backends/raycast/raster/convex.h"
#include "esim/backends/raycast/raster/sheets.h"

// Private to backends/raycast.
namespace esim::inline backends::inline raycast {

/// Positions in a pixel.
struct PixelSamples {
  static constexpr std::size_t kMax = 64;

  /// 1, 16 or 64 of them; throws UserError otherwise.
  explicit PixelSamples(int samples_per_pixel);

  PixelPoint operator[](std::size_t i) const { return {s[i], t[i]}; }

  std::size_t count;
  std::uint64_t all;  ///< a bit for each of them
  alignas(64) std::array<float, kMax> s{}, t{};

  /// Neighbouring samples follow each other: these are the middles and half the sides of rectangles around kBlock each.
  static constexpr std::size_t kBlock = 8;
  alignas(64) std::array<float, kMax / kBlock> block_s{}, block_t{}, half_s{}, half_t{};
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

  /// `for_shadows`: fragments contain the samples for shadows. All arguments must outlive it.
  Coverage(const CoverageSamples& samples, const SceneTriangles& triangles, bool for_shadows)
      : samples_(samples), dense_(samples.visibility), for_shadows_(for_shadows), sheets_(triangles) {}

  /// Begins with a cell, which must remain as it is.
  void begin(const CellSurfaces& surfaces, const ImageCell& cell) {
    surfaces_ = &surfaces, cell_ = &cell;
    sheets_.begin(surfaces, cell);
  }

  /// Appends the fragments of a pixel of the cell. The sum of their areas is 1 if no background is visible. If there
  /// are many candidates, parts below 1/64 of the pixel may be missed; areas are exact for surfaces of which nothing is
  /// hidden, and for a single one behind them, and multiples of 1/64 for others.
  SeenInMiddle divide(int pixel, std::vector<Fragment>& fragments);

 private:
  /// What samples see of a candidate.
  struct Part {
    std::uint32_t candidate;
    std::uint64_t visible_at;  // these samples
    bool whole;                // all that it covers; without any, it lies between samples
    Moments moments;           // of what it covers, if it is whole
  };

  // The candidate of that place in the order.
  const Candidate& found(std::size_t candidate) const { return found_[order_[candidate] & 0xffffffffU]; }
  const PixelTriangle& local(std::size_t candidate) const { return candidates_[order_[candidate] & 0xffffffffU]; }
  float nearest(std::size_t candidate) const;
  void put_in_order();
  SeenInMiddle look_at_middle() const;
  bool divide_exactly(std::vector<Fragment>& fragments);
  bool take(Convex& piece, std::size_t candidate);
  static bool is_apart(const Convex& piece, const PixelTriangle& surface);
  static bool keep_covered(Convex& piece, const PixelTriangle& surface, std::vector<Convex>& rests);
  bool hide(const PixelTriangle& surface, const PixelTriangle& other);
  void look_at(const PixelSamples& samples);
  void divide_by_samples(std::vector<Fragment>& fragments);
  void clip_whole_parts(std::size_t first);
  void add_neighbours();
  Moments moments_of_samples(std::uint64_t samples) const;
  void store_samples(std::span<Fragment> fragments);

  const CoverageSamples& samples_;
  const PixelSamples& dense_;
  bool for_shadows_;
  Sheets sheets_;
  const CellSurfaces* surfaces_ = nullptr;
  const ImageCell* cell_ = nullptr;
  // Of the current pixel.
  std::uint16_t pixel_;
  std::span<const Candidate> found_;
  PixelTriangles candidates_;
  std::vector<std::uint64_t> order_;                 // the nearest first: inverse depth, and the place in found_
  std::vector<std::uint64_t> covered_, visible_at_;  // samples in each of these, and samples that see it
  std::vector<Part> parts_;
  ClippedTriangles clipped_;
  std::vector<Convex> left_;       // of the pixel, for the next candidate
  std::vector<Convex> visible_;    // what a candidate takes of a piece
  std::vector<Convex> remaining_;  // what it leaves
};

}  // namespace esim::inline backends::inline raycast
