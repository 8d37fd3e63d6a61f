// (2), which reference.cpp uses as well. tests/event_camera/center_surround_test.cpp has its slow definition.
#pragma once

#include <vector>

#include "esim/core/image.h"

namespace esim::inline event_camera {

/// The lateral network of centre-surround pixels: each pixel's brightness minus that of its surround h, which follows
///     tau dh/dt = (L - h) + reach^2 * Laplacian(h)
/// with the four-neighbour Laplacian and mirrored borders (Delbruck, Li, Graca, McReynolds 2022, arXiv 2202.13076, as
/// modelled by v2e). Solved exactly for brightness that is linear in time between two images: the cosine transform
/// decomposes it into independent low-passes, one per cosine.
class CenterSurround {
 public:
  /// `reach_px` > 0; `tau_s` >= 0. Throws UserError if width or height is odd, which the transform does not support.
  CenterSurround(double reach_px, double tau_s, int width, int height);

  /// Starts in the steady state of `brightness`, and subtracts the surround from it.
  void open(Image<float>& brightness);

  /// Advances to `brightness`, `duration_s` later, and subtracts the surround from it.
  void advance(Image<float>& brightness, double duration_s);

  /// Its state, for core/state_archive.h.
  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    archive.image(self.wave_);
    archive.image(self.surround_);
  }

 private:
  void subtract(Image<float>& brightness);

  double tau_s_;
  std::vector<float> gain_;  // of each cosine, in the steady state
  Image<float> wave_;        // transform of the brightness at the last image
  Image<float> surround_;    // transform of the surround
  Image<float> next_;
};

}  // namespace esim::inline event_camera
