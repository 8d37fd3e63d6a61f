#include "esim/backends/opengl/gl_targets.h"

#include <algorithm>
#include <vector>

#include "esim/backends/opengl/gl_context.h"
#include "esim/core/error.h"

namespace esim::inline backends::inline opengl {
namespace {

GLuint make_texture(GLenum format, int width, int height, int samples) {
  GLuint name = 0;
  if (samples > 1) {
    glCreateTextures(GL_TEXTURE_2D_MULTISAMPLE, 1, &name);
    glTextureStorage2DMultisample(name, samples, format, width, height, GL_TRUE);
    return name;
  }
  glCreateTextures(GL_TEXTURE_2D, 1, &name);
  glTextureStorage2D(name, 1, format, width, height);
  glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  return name;
}

}  // namespace

GlTarget GlTarget::make(int width, int height, int samples, bool with_depth, GLenum floats, bool deforms) {
  GlTarget target;
  target.width = width, target.height = height;
  target.seen = make_texture(floats, width, height, samples);
  target.which = make_texture(GL_R16UI, width, height, samples);
  glCreateFramebuffers(1, &target.framebuffer);
  glNamedFramebufferTexture(target.framebuffer, GL_COLOR_ATTACHMENT0, target.seen, 0);
  glNamedFramebufferTexture(target.framebuffer, GL_COLOR_ATTACHMENT1, target.which, 0);
  if (with_depth) {
    const GLuint depth = make_texture(GL_DEPTH32F_STENCIL8, width, height, samples);
    glNamedFramebufferTexture(target.framebuffer, GL_DEPTH_STENCIL_ATTACHMENT, depth, 0);
  }
  if (deforms) {
    target.place = make_texture(GL_RGBA32F, width, height, samples);
    glNamedFramebufferTexture(target.framebuffer, GL_COLOR_ATTACHMENT2, target.place, 0);
  }
  constexpr GLenum kBuffers[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1, GL_COLOR_ATTACHMENT2};
  glNamedFramebufferDrawBuffers(target.framebuffer, deforms ? 3 : 2, kBuffers);
  throw_on_gl_error("allocating images");
  if (glCheckNamedFramebufferStatus(target.framebuffer, GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    throw UserError("gl: the driver cannot render to floating-point images; use engine: raycast");
  return target;
}

int offered_samples(int wanted) {
  int best = 1;
  for (const GLenum format : {GL_RGBA32F, GL_R16UI, GL_DEPTH32F_STENCIL8}) {
    GLint count = 0;
    glGetInternalformativ(GL_TEXTURE_2D_MULTISAMPLE, format, GL_NUM_SAMPLE_COUNTS, 1, &count);
    std::vector<GLint> offered(static_cast<std::size_t>(count));
    if (count > 0) glGetInternalformativ(GL_TEXTURE_2D_MULTISAMPLE, format, GL_SAMPLES, count, offered.data());
    int here = 1;
    for (const GLint samples : offered) {
      if (samples <= wanted) here = std::max(here, samples);
    }
    best = format == GL_RGBA32F ? here : std::min(best, here);
  }
  return best;
}

}  // namespace esim::inline backends::inline opengl
