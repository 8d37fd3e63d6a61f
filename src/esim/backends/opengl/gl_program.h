#pragma once

#include <epoxy/gl.h>

#include <vector>

// Private to backends/opengl: includes epoxy/gl.h.
namespace esim::inline backends::inline opengl {

/// The parts of a shader's source, in order, without the #version line.
using ShaderSource = std::vector<const char*>;

/// A shader program of the current context. Throws InternalError with the driver's log if the source does not compile.
GLuint make_program(const ShaderSource& vertex, const ShaderSource& fragment);

/// The same for a compute shader.
GLuint make_compute_program(const ShaderSource& compute);

// A program's uniforms, by name.
inline GLint location(GLuint program, const char* name) { return glGetUniformLocation(program, name); }
inline void set(GLuint program, const char* name, float value) { glUniform1f(location(program, name), value); }
inline void set(GLuint program, const char* name, int value) { glUniform1i(location(program, name), value); }
inline void set(GLuint program, const char* name, GLuint value) { glUniform1ui(location(program, name), value); }

}  // namespace esim::inline backends::inline opengl
