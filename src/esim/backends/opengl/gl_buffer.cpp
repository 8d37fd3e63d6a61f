#include "esim/backends/opengl/gl_buffer.h"

#include <algorithm>

#include "esim/backends/opengl/gl_context.h"
#include "esim/core/error.h"

namespace esim::inline backends::inline opengl {

void GlBuffer::make_room(std::size_t bytes) {
  constexpr std::size_t kMinBytes = 16;
  bytes = std::max(bytes, kMinBytes);
  if (bytes <= size_) return;
  if (name_ != 0) glDeleteBuffers(1, &name_);
  glCreateBuffers(1, &name_);
  glNamedBufferStorage(name_, static_cast<GLsizeiptr>(bytes), nullptr, flags_);
  size_ = bytes;
}

const void* GlBuffer::map() const {
  const void* const data = glMapNamedBufferRange(name_, 0, static_cast<GLsizeiptr>(size_), GL_MAP_READ_BIT);
  if (data == nullptr) throw_on_gl_error("reading an image back");
  if (data == nullptr) throw InternalError("gl: an image cannot be read back");
  return data;
}

void wait_for(GLsync& fence) {
  constexpr GLuint64 kSecond_ns = 1'000'000'000;
  GLenum state = GL_TIMEOUT_EXPIRED;
  while (state == GL_TIMEOUT_EXPIRED) state = glClientWaitSync(fence, GL_SYNC_FLUSH_COMMANDS_BIT, kSecond_ns);
  if (state == GL_WAIT_FAILED) throw InternalError("gl: waiting for an image failed");
  glDeleteSync(fence);
  fence = nullptr;
}

}  // namespace esim::inline backends::inline opengl
