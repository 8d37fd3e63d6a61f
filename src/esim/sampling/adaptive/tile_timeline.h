#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/large_vector.h"
#include "esim/core/time.h"

namespace esim::inline sampling {

/// The samples of a tile's pixels in order of time, and the error of predicting each of them from its neighbours.
///
/// Between two samples at distance h, irradiance is a straight line minus a curvature term,
///   E(f) = E0 + (E1 - E0) f - c h^2 f (1 - f) / 2,
/// where c is the mean of the second derivatives on both sides: the divided differences of three samples each. In the
/// middle of equally spaced samples this equals the cubic through all four. Errors are of brightness, L = ln(E +
/// log_eps).
class TileTimeline {
 public:
  TileTimeline(const Tile& tile, float log_eps) : tile_(tile), log_eps_(log_eps) {}

  const Tile& tile() const { return tile_; }

  /// Adds a sample at a time without one, from an image of the camera's size.
  void insert(TimeNs t, const Image<float>& irradiance);

  /// Removes the samples before the one with this index, except one that the curvature term needs. Returns the new
  /// index of the sample.
  std::size_t forget_before(std::size_t i);

  /// Prefetches the last samples and the place of the next one: other tiles have replaced them in the caches.
  void prefetch() const;

  /// The samples, for core/state_archive.h.
  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    archive.objects(self.samples_, [](auto& a, auto& sample) {
      a.value(sample.t);
      a.value(sample.surprise);
      a.value(sample.bend);
      a.list(sample.irradiance);
      a.list(sample.brightness);
    });
  }

  std::size_t size() const { return samples_.size(); }
  TimeNs time(std::size_t i) const { return samples_[i].t; }

  /// Prediction error of sample i: error of its brightness if it were interpolated from the other samples, root mean
  /// square over the watched pixels, about a sixth of the tile. Only for samples between others.
  double surprise(std::size_t i) const { return samples_[i].surprise; }

  /// Errors of that interpolation at each watched pixel, ln units.
  void errors(std::size_t i, std::vector<float>& out) const;

  /// Brightness of each watched pixel at sample i.
  std::span<const float> brightness(std::size_t i) const { return samples_[i].brightness; }

  /// Deviation of brightness from a straight line in the middle between samples i and i + 1, root mean square as above:
  /// the smaller of the estimates from the second differences of brightness at both samples.
  double curvature(std::size_t i) const;

  /// Irradiance of the tile's pixels at sample i, row by row. Valid until the next insert(), even if the sample is
  /// removed.
  const float* irradiance(std::size_t i) const { return samples_[i].irradiance.data(); }

  /// Writes the irradiance in the middle between samples i and i + 1, or at each quarter.
  void write_half(std::size_t i, float* half) const;
  void write_quarters(std::size_t i, const std::array<float*, 3>& quarters) const;

 private:
  struct Sample {
    TimeNs t = 0;
    double surprise = 0;
    double bend = 0;  // deviation of brightness from the straight line between its neighbours, root mean square
    LargeVector<float> irradiance;
    LargeVector<float> brightness;  // of the watched pixels
  };
  struct Curvature;

  Curvature curvature_between(std::size_t first, std::size_t last) const;
  void measure(std::size_t i);

  Tile tile_;
  float log_eps_;
  std::vector<Sample> samples_;
  std::vector<Sample> unused_;  // memory to reuse
  std::vector<float> errors_;   // of measure()
};

}  // namespace esim::inline sampling
