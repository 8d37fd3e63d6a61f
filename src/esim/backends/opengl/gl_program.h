#pragma once

#include <epoxy/gl.h>

namespace esim {

/// A shader program; belongs to the current context and ends with it. Throws InternalError with the driver's log where
/// the source does not compile.
GLuint make_program(const char* vertex_source, const char* fragment_source);

/// Names of the inputs, outputs and bindings that the shaders and their users share.
inline constexpr GLuint kPosition = 0, kNormal = 1, kTextureUv = 2;
inline constexpr GLuint kLightsBinding = 0;

extern const char* const kSurfaceVertexShader;
extern const char* const kSurfaceFragmentShader;
extern const char* const kWholeImageVertexShader;
extern const char* const kResolveFragmentShader;
extern const char* const kDistortFragmentShader;

}  // namespace esim
