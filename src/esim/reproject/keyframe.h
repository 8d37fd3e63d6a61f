#pragma once

#include "esim/core/image.h"
#include "esim/core/parallel.h"
#include "esim/geometry/camera.h"
#include "esim/render/pixel_rays.h"
#include "esim/render/renderer.h"
#include "esim/reproject/surfaces.h"

namespace esim {

/// How a keyframe's image lies around the sensor's: `supersampling` pixels to one of the sensor's in each direction,
/// and `margin_px` of the sensor's pixels more on each side. The sensor's pixel (u, v) has its centre at
///     s (u + margin + 1/2) - 1/2
/// of the keyframe, likewise for v: focal lengths and principal point follow, the lens's distortion stays as it is.
struct KeyframeLayout {
  Camera sensor;
  int supersampling = 2;
  int margin_px = 0;
  Camera camera;            ///< of the keyframes
  bool wide_pixels = true;  ///< the renderer averages over the camera's footprint: over a pixel of the sensor

  /// The first row and column of those that are thrown into views.
  int first() const { return supersampling / 2; }

  /// Where the mean over a pixel of the sensor lies from the keyframe's pixel that holds it, px.
  float offset() const { return wide_pixels ? 0.0F : 0.5F * static_cast<float>(supersampling - 1); }
};

/// A camera with `s` pixels to one of the sensor's in each direction, and `margin` of the sensor's more on each side.
Camera denser(const Camera& sensor, int s, int margin);

/// Lays out keyframes. Where the lens cannot be inverted as far outside the sensor, the margin becomes smaller.
KeyframeLayout lay_out_keyframes(const Camera& sensor, int supersampling, int margin_px, bool wide_pixels);

/// A rendered keyframe, prepared for being looked up from other views.
struct Keyframe {
  RenderRequest view;  ///< its time, where the camera and the moving objects were

  /// An image of the keyframe's size.
  struct Light {
    Image<float> root;   ///< spline coefficients of the root of E
    Image<float> front;  ///< nearness; beside a nearer surface, whose light E holds too, that one's
  };
  Light wide;    ///< each pixel the mean over the area of one of the sensor's
  Light narrow;  ///< each pixel the mean over its own area; without size where the renderer does not tell

  SurfacePoints sparse;  ///< of every s-th pixel of every s-th row, from KeyframeLayout::first() on
  SurfacePoints dense;   ///< of all pixels that edges cross and of every second pixel of every second row: each covers
                         ///< the four around it; none without `narrow`
};

/// Prepares a sample of the whole keyframe, whose buffers are taken. `rays`: of the layout's camera.
void prepare_keyframe(const KeyframeLayout& layout, const PixelRays& rays, bool at_infinity, RenderRequest view,
                      Sample& sample, const Workers& workers, Keyframe& keyframe);

}  // namespace esim
