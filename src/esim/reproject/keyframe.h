#pragma once

#include "esim/core/image.h"
#include "esim/core/parallel.h"
#include "esim/geometry/camera.h"
#include "esim/render/renderer.h"

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

  /// The first row and column of those that are thrown into views, and how many there are.
  int first() const { return supersampling / 2; }
  int columns() const { return (camera.width - first() + supersampling - 1) / supersampling; }
  int rows() const { return (camera.height - first() + supersampling - 1) / supersampling; }

  /// Where the mean over a pixel of the sensor lies from the keyframe's pixel that holds it, px.
  float offset() const { return wide_pixels ? 0.0F : 0.5F * static_cast<float>(supersampling - 1); }
};

/// Lays out keyframes. Where the lens cannot be inverted as far outside the sensor, the margin becomes smaller.
KeyframeLayout lay_out_keyframes(const Camera& sensor, int supersampling, int margin_px, bool wide_pixels);

/// A rendered keyframe, prepared for being looked up from other views.
struct Keyframe {
  RenderRequest view;  ///< its time, where the camera and the moving objects were

  // Of the keyframe's size.
  Image<float> root;   ///< spline coefficients of the root of E, mean over the area of one of the sensor's pixels
  Image<float> front;  ///< nearness; beside a nearer surface, whose light E holds too, that one's

  // Of every s-th pixel of every s-th row, from KeyframeLayout::first() on: these are thrown into views.
  Image<float> nearness;          ///< 1 / Z, 1/m; 0 for what is infinitely far, and where Z is none
  Image<float> slope_x, slope_y;  ///< of nearness per pixel, on the smooth surface that is seen; 0 where there is none
  Image<std::uint16_t> object;    ///< 0: what stands still, i + 1: object i; without size where nothing moves
};

/// Prepares a sample of the whole keyframe, whose buffers are taken.
void prepare_keyframe(const KeyframeLayout& layout, bool at_infinity, RenderRequest view, Sample& sample,
                      const Workers& workers, Keyframe& keyframe);

}  // namespace esim
