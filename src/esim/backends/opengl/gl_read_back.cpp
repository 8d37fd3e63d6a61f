#include "esim/backends/opengl/gl_read_back.h"

#include <algorithm>
#include <cstdint>

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

void GlReadBack::start(const GlTarget& target, const std::vector<Tile>& tiles, bool with_objects) {
  std::size_t pixels = 0;
  for (const Tile& tile : tiles) pixels += static_cast<std::size_t>(tile.area());
  seen_.make_room(pixels * kSeenBytes);
  if (with_objects) which_.make_room(pixels * kWhichBytes);

  glBindFramebuffer(GL_READ_FRAMEBUFFER, target.framebuffer);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  read(seen_.name(), GL_COLOR_ATTACHMENT0, GL_RGBA, GL_FLOAT, kSeenBytes, tiles);
  if (with_objects) read(which_.name(), GL_COLOR_ATTACHMENT1, GL_RED_INTEGER, GL_UNSIGNED_SHORT, kWhichBytes, tiles);
  if (target.place != 0) {
    place_.make_room(pixels * kSeenBytes);
    read(place_.name(), GL_COLOR_ATTACHMENT2, GL_RGBA, GL_FLOAT, kSeenBytes, tiles);
  }
  glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  if (done_ != nullptr) glDeleteSync(done_);
  done_ = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
  glFlush();  // otherwise nothing would begin before finish()
}

void GlReadBack::finish(Sample& sample) {
  wait_for(done_);
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
  seen_.unmap();
  if (sample.object.empty()) return;

  const auto* which = static_cast<const std::uint16_t*>(which_.map());
  for (const Tile& tile : sample.tiles) {
    for (int y = tile.y; y < tile.y + tile.height; ++y, which += tile.width)
      std::copy_n(which, tile.width, sample.object.row(y) + tile.x);
  }
  which_.unmap();
  if (sample.surface.empty()) return;

  const auto* place = static_cast<const float*>(place_.map());
  for (const Tile& tile : sample.tiles) {
    for (int y = tile.y; y < tile.y + tile.height; ++y) {
      for (int x = tile.x; x < tile.x + tile.width; ++x, place += 4)
        sample.surface(x, y) = {static_cast<std::uint32_t>(std::max(place[0], 0.0F)), place[1], place[2]};
    }
  }
  place_.unmap();
}

}  // namespace esim::inline backends::inline opengl
