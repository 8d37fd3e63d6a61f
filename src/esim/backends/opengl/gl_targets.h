#pragma once

#include <epoxy/gl.h>

namespace esim {

/// A framebuffer of floats and the object (16 bits) per pixel, on textures. What the floats are, and how many, depends
/// on the pass: E, Z and V after the last one; E, 1 / Z and how that changes before. Ends with its context. Private to
/// the renderer.
struct GlTarget {
  GLuint framebuffer = 0, seen = 0, which = 0;
  int width = 0, height = 0;

  /// With more than one sample per pixel, that many of the next number that the driver offers; `with_depth` (and a
  /// stencil) for drawing surfaces; `floats` is GL_RGBA32F, or GL_RG32F to keep the first two only.
  static GlTarget make(int width, int height, int samples, bool with_depth, GLenum floats);
};

/// The largest number of samples per pixel that the driver offers for a target, not above `wanted`.
int offered_samples(int wanted);

}  // namespace esim
