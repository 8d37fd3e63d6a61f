#pragma once

#include <vector>

#include "esim/core/image.h"

namespace esim {

/// The centre-surround pixel's lateral network: each pixel's brightness less that of its surround h, which follows
///     tau dh/dt = (L - h) + reach^2 * Laplacian(h)
/// with the four-neighbour Laplacian and mirrored borders (Delbruck, Li, Graca, McReynolds 2022, arXiv 2202.13076, as
/// v2e models it). Solved exactly for brightness that is linear in time between two images: the cosine transform makes
/// each of its waves a low-pass of its own.
class CenterSurround {
 public:
  /// `reach_px` > 0; `tau_s` >= 0. Throws UserError where width or height is odd, which the transform does not take.
  CenterSurround(double reach_px, double tau_s, int width, int height);

  /// Starts in the steady state of `brightness`, and subtracts the surround from it.
  void open(Image<float>& brightness);

  /// Moves on to `brightness`, `duration_s` later, and subtracts the surround from it.
  void advance(Image<float>& brightness, double duration_s);

  /// What it remembers, for state_archive.h.
  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    archive.image(self.wave_);
    archive.image(self.surround_);
  }

 private:
  void subtract(Image<float>& brightness);

  double tau_s_;
  std::vector<float> gain_;  // of each wave, in the steady state
  Image<float> wave_;        // of the brightness at the last image
  Image<float> surround_;    // in waves
  Image<float> next_;
};

}  // namespace esim
