#include "esim/backends/opengl/gl_program.h"

#include <initializer_list>
#include <string>
#include <vector>

#include "esim/core/error.h"

namespace esim::inline backends::inline opengl {
namespace {

/// Throws unless `status` of a shader or program is true; `get` and `get_log` are OpenGL's functions for its type.
template <typename Get, typename GetLog>
void require(GLuint name, GLenum status, const Get& get, const GetLog& get_log, const char* problem) {
  GLint good = GL_FALSE, length = 0;
  get(name, status, &good);
  if (good == GL_TRUE) return;
  get(name, GL_INFO_LOG_LENGTH, &length);
  std::vector<char> log(static_cast<std::size_t>(length) + 1);
  get_log(name, length, nullptr, log.data());
  throw InternalError(std::string("gl: ") + problem + ": " + log.data());
}

GLuint compile(GLenum type, const ShaderSource& parts) {
  std::vector<const char*> source = {"#version 450 core\n"};
  source.insert(source.end(), parts.begin(), parts.end());
  const GLuint shader = glCreateShader(type);
  glShaderSource(shader, static_cast<GLsizei>(source.size()), source.data(), nullptr);
  glCompileShader(shader);
  require(shader, GL_COMPILE_STATUS, glGetShaderiv, glGetShaderInfoLog, "a shader does not compile");
  return shader;
}

GLuint link(std::initializer_list<GLuint> shaders) {
  const GLuint program = glCreateProgram();
  for (const GLuint shader : shaders) {
    glAttachShader(program, shader);
    glDeleteShader(shader);
  }
  glLinkProgram(program);
  require(program, GL_LINK_STATUS, glGetProgramiv, glGetProgramInfoLog, "a program does not link");
  return program;
}

}  // namespace

GLuint make_program(const ShaderSource& vertex, const ShaderSource& fragment) {
  return link({compile(GL_VERTEX_SHADER, vertex), compile(GL_FRAGMENT_SHADER, fragment)});
}

GLuint make_compute_program(const ShaderSource& compute) { return link({compile(GL_COMPUTE_SHADER, compute)}); }

}  // namespace esim::inline backends::inline opengl
