#pragma once

#include <Eigen/Core>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/parallel.h"
#include "esim/render/pixel_rays.h"
#include "esim/reproject/keyframe.h"

namespace esim {

/// Takes points of one view to another: of a bearing b and a nearness w = 1/Z there, y = R b + w t is Z^-1 times the
/// point here, so that it appears at y / y_z and has the nearness w / y_z. w = 0 is infinitely far.
struct ViewChange {
  Eigen::Matrix3f R;
  Eigen::Vector3f t;
};

/// From view `from` to view `to`: of what stands still at [0], of object i at [i + 1].
std::vector<ViewChange> view_changes(const RenderRequest& from, const RenderRequest& to);

/// What a view would see of keyframes, at the resolution of keyframes and without their margin.
struct VisibleSurface {
  Image<float> nearness;        ///< 1/Z in the view; kNothing where no keyframe's pixel falls
  Image<std::uint16_t> object;  ///< as in Keyframe

  static constexpr float kNothing = -1.0F;
};

/// Throws the pixels of keyframes into a view, each onto the up to four places around where it falls; the nearest
/// stays.
class DepthSplat {
 public:
  /// `rays`: of the keyframes' camera.
  DepthSplat(const KeyframeLayout& layout, const PixelRays& rays, double greatest_radius, const Workers& workers);

  /// Throws `keyframes` into `view`.
  void splat(const std::vector<const Keyframe*>& keyframes, const RenderRequest& view, VisibleSurface& surface);

 private:
  static constexpr int kChunk = 32;     // pixels of a row that are thrown together
  static constexpr int kBandRows = 16;  // rows of the view that one thread fills

  void throw_row(const Keyframe& keyframe, const std::vector<ViewChange>& changes, int row);
  void collect(const Keyframe& keyframe, int begin, int end, VisibleSurface& surface) const;

  const KeyframeLayout& layout_;
  double greatest_radius_;
  const Workers& workers_;
  int chunks_;                             // of a row
  Image<float> x_, y_;                     // bearings (x, y, 1) of the pixels that are thrown
  Image<float> column_, row_, inverse_z_;  // where each pixel falls, and 1 / y_z there
  Image<float> first_row_, last_row_;      // of the pixels of each chunk
};

}  // namespace esim
