#pragma once

#include <epoxy/gl.h>

// Private to backends/opengl: includes epoxy/gl.h.
namespace esim::inline backends::inline opengl {

/// A framebuffer with floats and the object (16 bits) per pixel, in textures. The floats depend on the pass: E, Z and V
/// after the last one; E, 1 / Z and its slopes before. Belongs to its context.
struct GlTarget {
  GLuint framebuffer = 0, seen = 0, which = 0, place = 0;
  int width = 0, height = 0;

  /// With `samples` per pixel, or the next higher number that the driver supports; `with_depth` (and a stencil) for
  /// drawing surfaces; `floats` is GL_RGBA32F, or GL_RG32F to store the first two only; `deforms`: with `place`, the
  /// points of surfaces.
  static GlTarget make(int width, int height, int samples, bool with_depth, GLenum floats, bool deforms);
};

/// The largest number of samples per pixel that the driver supports for a target, at most `wanted`.
int offered_samples(int wanted);

}  // namespace esim::inline backends::inline opengl
