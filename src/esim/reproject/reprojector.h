#pragma once

#include "esim/reproject/cells.h"
#include "esim/reproject/depth_splat.h"
#include "esim/reproject/keyframe.h"

namespace esim::inline reproject {

/// Result of a reconstruction.
struct Reconstruction {
  Image<float> irradiance;  ///< E of the sensor's pixels

  // Only with Detail::apart: E from each keyframe alone; below 0 if that keyframe does not see the pixel.
  Image<float> from_before, from_after;
  std::int64_t unseen = 0;  ///< pixels that neither keyframe sees
};

/// Level of detail of a reconstruction.
enum class Detail {
  whole,  ///< pixels near depth edges at many places, each with its own surface, if keyframes have narrow pixels
  apart,  ///< every pixel at one place, and each keyframe's prediction separately, for comparison
};

/// Reconstructs E between two keyframes. First it finds the surface that a view sees by projecting the keyframes'
/// pixels into the view. Then it looks up the surface's points in each keyframe, and blends them by the distance in
/// time if both keyframes see them. The geometry is exact if poses, depth and lens are; the resolution is limited by
/// that of the keyframes. A pure function of its arguments for any number of threads.
class Reprojector {
 public:
  /// `at_infinity`: everything is infinitely far, and depth is ignored.
  Reprojector(const KeyframeLayout& layout, bool at_infinity, const Workers& workers, SceneParts parts = {});

  Reprojector(const Reprojector&) = delete;
  Reprojector& operator=(const Reprojector&) = delete;

  const KeyframeLayout& layout() const { return layout_; }

  /// Prepares a keyframe from its light, and from the depth and the objects of a sample of the whole image.
  void prepare(RenderRequest view, const Sample& sample, KeyframeLight light, Keyframe& keyframe) const;

  /// Reconstructs E of the sensor at `view`; view.t must lie between the times of the keyframes.
  void reconstruct(const Keyframe& before, const Keyframe& after, const RenderRequest& view, Detail detail,
                   Reconstruction& result);

 private:
  struct Between;

  template <typename Model>
  void look_up(const Between& between, const Model& model, Detail detail, Reconstruction& result);
  template <typename Model>
  void refine(const Between& between, const Model& model, Reconstruction& result);

  KeyframeLayout layout_;
  SceneParts parts_;
  bool at_infinity_;
  PixelRays rays_, keyframe_rays_;
  double greatest_radius_;  // maximum radius of the keyframe's bearings
  const Workers& workers_;
  DepthSplat splat_;
  Cells cells_;
  VisibleSurface surface_;  // of the sensor's pixels
};

}  // namespace esim::inline reproject
