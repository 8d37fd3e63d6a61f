#pragma once

#include "esim/reproject/cells.h"
#include "esim/reproject/depth_splat.h"
#include "esim/reproject/keyframe.h"

namespace esim {

/// What a reconstruction saw of its keyframes.
struct Reconstruction {
  Image<float> irradiance;  ///< E of the sensor's pixels

  // Only where asked for: E from either keyframe alone; below 0 where that keyframe does not see the pixel.
  Image<float> from_before, from_after;
  std::int64_t unseen = 0;  ///< pixels that neither keyframe sees
};

/// How much a reconstruction looks at.
enum class Detail {
  whole,  ///< pixels near depth edges at many places, each with its own surface, where keyframes have narrow pixels
  apart,  ///< every pixel at one place, and each keyframe's prediction on its own: for comparing them
};

/// Reconstructs E between two keyframes: the surface that a view sees is found by throwing the keyframes' pixels into
/// it; its points are then looked up in either keyframe, and blended by the distance in time where both see them. Exact
/// where poses, depth and lens are: what it costs is the keyframes' resolution. A pure function of its arguments, with
/// any number of threads.
class Reprojector {
 public:
  /// `at_infinity`: everything is infinitely far; depth is not looked at.
  Reprojector(const KeyframeLayout& layout, bool at_infinity, const Workers& workers);

  Reprojector(const Reprojector&) = delete;
  Reprojector& operator=(const Reprojector&) = delete;

  const KeyframeLayout& layout() const { return layout_; }

  /// Prepares a sample of the whole keyframe, whose buffers are taken.
  void prepare(RenderRequest view, Sample& sample, Keyframe& keyframe) const;

  /// E as seen by the sensor where `view` has it; view.t between those of the keyframes.
  void reconstruct(const Keyframe& before, const Keyframe& after, const RenderRequest& view, Detail detail,
                   Reconstruction& result);

 private:
  struct Between;

  template <typename Model>
  void look_up(const Between& between, const Model& model, Detail detail, Reconstruction& result);
  template <typename Model>
  void refine(const Between& between, const Model& model, Reconstruction& result);

  KeyframeLayout layout_;
  bool at_infinity_;
  PixelRays rays_, keyframe_rays_;
  double greatest_radius_;  // of the keyframe's bearings
  const Workers& workers_;
  DepthSplat splat_;
  Cells cells_;
  VisibleSurface surface_;  // of the sensor's pixels
};

}  // namespace esim
