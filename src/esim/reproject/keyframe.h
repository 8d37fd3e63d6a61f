#pragma once

#include <cstdint>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/parallel.h"
#include "esim/geometry/camera.h"
#include "esim/render/pixel_rays.h"
#include "esim/render/renderer.h"
#include "esim/reproject/parts.h"
#include "esim/reproject/surfaces.h"

namespace esim::inline reproject {

/// Layout of a keyframe's image relative to the sensor's: `supersampling` keyframe pixels per sensor pixel along each
/// side, and a margin of `margin_px` sensor pixels on each side. The centre of the sensor's pixel (u, v) is at
///     s (u + margin + 1/2) - 1/2
/// in the keyframe, likewise for v. Focal lengths and principal point are adapted; the distortion is the same.
struct KeyframeLayout {
  Camera sensor;
  int supersampling = 2;
  int margin_px = 0;
  Camera camera;  ///< of the keyframes

  /// The first row and column of the points that are projected into views.
  int first() const { return supersampling / 2; }
};

/// A camera with `s` pixels per sensor pixel along each side, and a margin of `margin` sensor pixels on each side.
Camera denser(const Camera& sensor, int s, int margin);

/// Lays out keyframes. The margin is reduced if the lens cannot be inverted that far outside the sensor.
KeyframeLayout lay_out_keyframes(const Camera& sensor, int supersampling, int margin_px);

/// E of a keyframe as it was rendered. One of the images may be empty.
struct KeyframeLight {
  Image<float> wide;    ///< each pixel is the mean over the area of a sensor pixel; if empty, computed from `narrow`
  Image<float> narrow;  ///< each pixel is the mean over its own area; if empty, edges are not looked up more closely
  bool look_closely = true;  ///< false: `narrow` serves only to compute `wide`
};

/// A rendered keyframe, prepared for lookups from other views.
struct Keyframe {
  RenderRequest view;  ///< time, and poses of the camera and of the moving objects

  /// Images of the keyframe's size.
  struct Light {
    Image<float> root;   ///< spline coefficients of the square root of E, with a border of one pixel
    Image<float> front;  ///< nearness; next to a nearer surface, which E then contains, that of the nearer one
    float offset = 0;    ///< from the pixel that stores a mean to the centre of its area, px to the right and below
  };
  Light wide;    ///< each pixel is the mean over the area of a sensor pixel
  Light narrow;  ///< each pixel is the mean over its own area; may be empty

  std::vector<std::uint16_t> deforming;  ///< the parts of deforming objects that it sees, in order

  SurfacePoints sparse;  ///< every s-th pixel of every s-th row, from KeyframeLayout::first() on
  SurfacePoints dense;  ///< all pixels at edges, and every second pixel of every second row: each point covers the four
                        ///< pixels around it; empty without `narrow`
};

/// Prepares a keyframe from its light, and from the depth and the objects of a sample of the whole image. `rays`: of
/// the layout's camera.
void prepare_keyframe(const KeyframeLayout& layout, const PixelRays& rays, const SceneParts& parts, bool at_infinity,
                      RenderRequest view, const Sample& sample, KeyframeLight light, const Workers& workers,
                      Keyframe& keyframe);

}  // namespace esim::inline reproject
