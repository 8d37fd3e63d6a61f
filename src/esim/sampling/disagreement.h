#pragma once

#include <array>
#include <cstdint>

#include "esim/core/parallel.h"
#include "esim/reproject/reprojector.h"
#include "esim/sampling/sampler.h"

namespace esim {

/// Distribution of errors >= 0, in bins of 3 % from 1e-6 to 10.
class ErrorHistogram {
 public:
  void add(double error);
  MeasuredError summary() const;

 private:
  static constexpr int kBins = 560;
  std::array<std::int64_t, kBins> counts_{};
  std::int64_t count_ = 0;
  double sum_ = 0, max_ = 0;
};

/// By how much two keyframes disagree on an image between them: |mean of L_before - L_after| over blocks of 8 x 8
/// pixels of which both see at least a quarter, and of those the one that 0.2 % exceed. The mean leaves out what
/// resampling and edges do to single pixels, and keeps what changes over an area: light, shadows, reflections. Adds
/// each pixel's disagreement to `pixels`.
double disagreement(const Reconstruction& apart, double log_eps, ErrorHistogram& pixels);

}  // namespace esim
