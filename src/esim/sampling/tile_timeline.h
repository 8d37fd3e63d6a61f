#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/large_vector.h"
#include "esim/core/time.h"

namespace esim {

/// What is known of a tile's pixels: samples in order of time, and how well each of them could have been foretold from
/// those around it.
///
/// Between two samples at distance h, irradiance is the straight line less a bow, E(f) = E0 + (E1 - E0) f - c h^2 f (1
/// - f) / 2, where c is the mean of the second derivatives on both sides: the divided differences of three samples
/// each. In the middle of samples at equal distances that is the cubic through all four. Errors are of brightness,
/// L = ln(E + log_eps).
class TileTimeline {
 public:
  TileTimeline(const Tile& tile, float log_eps) : tile_(tile), log_eps_(log_eps) {}

  const Tile& tile() const { return tile_; }

  /// Adds a sample at a time of which there is none yet, from an image of the camera's size.
  void insert(TimeNs t, const Image<float>& irradiance);

  /// Forgets the samples before the one with this index, but for one that bows begin from.
  /// Returns the index that the sample has then.
  std::size_t forget_before(std::size_t i);

  /// Asks memory for the last samples, and for the place of the next: since they were taken, the caches have been full
  /// of other tiles.
  void prefetch() const;

  std::size_t size() const { return samples_.size(); }
  TimeNs time(std::size_t i) const { return samples_[i].t; }

  /// How far off brightness at sample i would be had it been interpolated from the others: the root of the mean square
  /// over about a sixth of the tile's pixels, those that are watched. Only for samples between others.
  double surprise(std::size_t i) const { return samples_[i].surprise; }

  /// Errors of that interpolation for each pixel that is watched, ln units.
  void errors(std::size_t i, std::vector<float>& out) const;

  /// Of each of those pixels at sample i.
  std::span<const float> brightness(std::size_t i) const { return samples_[i].brightness; }

  /// How far brightness between samples i and i + 1 is from its own straight line, in the middle, likewise: by the
  /// second differences of brightness at both samples, and no more than twice what the smaller one says.
  double bow(std::size_t i) const;

  /// Irradiance of the tile's pixels at sample i, row by row. It stays until the next insert(), even if the sample is
  /// forgotten.
  const float* irradiance(std::size_t i) const { return samples_[i].irradiance.data(); }

  /// Writes the same half of the way from sample i to the next, and after each quarter of it.
  void write_half(std::size_t i, float* half) const;
  void write_quarters(std::size_t i, const std::array<float*, 3>& quarters) const;

 private:
  struct Sample {
    TimeNs t = 0;
    double surprise = 0;
    double bend = 0;  // how far brightness is from the straight line between its neighbours, root of the mean square
    LargeVector<float> irradiance;
    LargeVector<float> brightness;  // of watched pixels
  };
  struct Bow;

  Bow bow_between(std::size_t first, std::size_t last) const;
  void measure(std::size_t i);

  Tile tile_;
  float log_eps_;
  std::vector<Sample> samples_;
  std::vector<Sample> unused_;  // memory
  std::vector<float> errors_;   // likewise
};

}  // namespace esim
