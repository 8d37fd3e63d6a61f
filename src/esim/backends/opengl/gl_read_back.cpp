#include "esim/backends/opengl/gl_read_back.h"

#include <algorithm>
#include <cstdint>

#include "esim/backends/opengl/gl_context.h"
#include "esim/core/error.h"

namespace esim::inline backends::inline opengl {
namespace {

constexpr std::size_t kSeenBytes = 4 * sizeof(float), kWhichBytes = sizeof(std::uint16_t);

void read(GLuint buffer, GLenum attachment, GLenum layout, GLenum type, std::size_t bytes,
          const std::vector<Tile>& tiles) {
  glReadBuffer(attachment);
  glBindBuffer(GL_PIXEL_PACK_BUFFER, buffer);
  std::size_t offset = 0;
  for (const Tile& tile : tiles) {
    glReadPixels(tile.x, tile.y, tile.width, tile.height, layout, type, reinterpret_cast<void*>(offset));
    offset += static_cast<std::size_t>(tile.area()) * bytes;
  }
}

}  // namespace

void GlReadBack::Buffer::make_room(std::size_t bytes) {
  if (bytes <= size) return;
  if (name != 0) glDeleteBuffers(1, &name);
  glCreateBuffers(1, &name);
  glNamedBufferStorage(name, static_cast<GLsizeiptr>(bytes), nullptr, GL_MAP_READ_BIT | GL_CLIENT_STORAGE_BIT);
  size = bytes;
}

const void* GlReadBack::Buffer::map() const {
  const void* const data = glMapNamedBufferRange(name, 0, static_cast<GLsizeiptr>(size), GL_MAP_READ_BIT);
  if (data == nullptr) throw_on_gl_error("reading an image back");
  if (data == nullptr) throw InternalError("gl: an image cannot be read back");
  return data;
}

void GlReadBack::start(const GlTarget& target, const std::vector<Tile>& tiles, bool with_objects) {
  std::size_t pixels = 0;
  for (const Tile& tile : tiles) pixels += static_cast<std::size_t>(tile.area());
  seen_.make_room(pixels * kSeenBytes);
  if (with_objects) which_.make_room(pixels * kWhichBytes);

  glBindFramebuffer(GL_READ_FRAMEBUFFER, target.framebuffer);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  read(seen_.name, GL_COLOR_ATTACHMENT0, GL_RGBA, GL_FLOAT, kSeenBytes, tiles);
  if (with_objects) read(which_.name, GL_COLOR_ATTACHMENT1, GL_RED_INTEGER, GL_UNSIGNED_SHORT, kWhichBytes, tiles);
  glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  if (done_ != nullptr) glDeleteSync(done_);
  done_ = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
  glFlush();  // otherwise nothing would begin before finish()
}

void GlReadBack::finish(Sample& sample) {
  constexpr GLuint64 kSecond_ns = 1'000'000'000;
  GLenum state = GL_TIMEOUT_EXPIRED;
  while (state == GL_TIMEOUT_EXPIRED) state = glClientWaitSync(done_, GL_SYNC_FLUSH_COMMANDS_BIT, kSecond_ns);
  if (state == GL_WAIT_FAILED) throw InternalError("gl: waiting for an image failed");
  glDeleteSync(done_);
  done_ = nullptr;

  const auto* seen = static_cast<const float*>(seen_.map());
  for (const Tile& tile : sample.tiles) {
    for (int y = tile.y; y < tile.y + tile.height; ++y) {
      float *const irradiance = sample.irradiance.row(y) + tile.x, *const depth = sample.depth.row(y) + tile.x;
      float *const motion_x = sample.motion_x.row(y) + tile.x, *const motion_y = sample.motion_y.row(y) + tile.x;
#pragma GCC ivdep
      for (int x = 0; x < tile.width; ++x) {
        irradiance[x] = seen[4 * x], depth[x] = seen[4 * x + 1];
        motion_x[x] = seen[4 * x + 2], motion_y[x] = seen[4 * x + 3];
      }
      seen += 4 * tile.width;
    }
  }
  glUnmapNamedBuffer(seen_.name);
  if (sample.object.empty()) return;

  const auto* which = static_cast<const std::uint16_t*>(which_.map());
  for (const Tile& tile : sample.tiles) {
    for (int y = tile.y; y < tile.y + tile.height; ++y, which += tile.width)
      std::copy_n(which, tile.width, sample.object.row(y) + tile.x);
  }
  glUnmapNamedBuffer(which_.name);
}

}  // namespace esim::inline backends::inline opengl
