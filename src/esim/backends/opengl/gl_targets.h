#pragma once

#include <epoxy/gl.h>

namespace esim {

/// A framebuffer of E and 1 / Z (floats) and the object (16 bits) per pixel, on textures. Ends with its context.
/// Private to the renderer.
struct GlTarget {
  GLuint framebuffer = 0, seen = 0, which = 0;
  int width = 0, height = 0;

  /// With more than one sample per pixel, that many of the next number that the driver offers; `with_depth` (and a
  /// stencil) for drawing surfaces.
  /// `with_slopes` keeps two floats more: how 1 / Z changes to the right and downwards.
  static GlTarget make(int width, int height, int samples, bool with_depth, bool with_slopes);
};

/// The largest number of samples per pixel that the driver offers for a target, not above `wanted`.
int offered_samples(int wanted);

}  // namespace esim
