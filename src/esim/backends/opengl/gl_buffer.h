#pragma once

#include <epoxy/gl.h>

#include <cstddef>

// Private to backends/opengl: includes epoxy/gl.h.
namespace esim::inline backends::inline opengl {

/// A buffer of a context that grows. It belongs to its context, which must be current.
class GlBuffer {
 public:
  /// `flags` as of glNamedBufferStorage.
  explicit GlBuffer(GLbitfield flags = 0) : flags_(flags) {}

  GLuint name() const { return name_; }
  std::size_t size() const { return size_; }  ///< bytes

  /// Makes it at least this large, at least 16 bytes. Its content is lost if it grows.
  void make_room(std::size_t bytes);

  void bind(GLuint binding) const { glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, name_); }

  /// Its content, until unmap(). The flags must contain GL_MAP_READ_BIT.
  const void* map() const;
  void unmap() const { glUnmapNamedBuffer(name_); }

 private:
  GLbitfield flags_;
  GLuint name_ = 0;
  std::size_t size_ = 0;
};

/// Waits for a fence, and deletes it.
void wait_for(GLsync& fence);

}  // namespace esim::inline backends::inline opengl
