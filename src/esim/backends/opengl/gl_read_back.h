#pragma once

#include <epoxy/gl.h>

#include <vector>

#include "esim/backends/opengl/gl_targets.h"
#include "esim/render/sample.h"

namespace esim {

/// Pixels on their way from the device into memory. Used with its context current, and ends with that. Private to the
/// renderer.
class GlReadBack {
 public:
  /// Begins to copy the tiles' E, Z and V, and with `with_objects` which object is seen, as soon as all that has been
  /// drawn is there. What was under way before is forgotten.
  void start(const GlTarget& target, const std::vector<Tile>& tiles, bool with_objects);

  /// Waits for them, and puts them into `sample`, which has room and names the tiles.
  void finish(Sample& sample);

 private:
  /// A buffer that the device writes pixels to and the processor reads them from.
  struct Buffer {
    GLuint name = 0;
    std::size_t size = 0;  // bytes

    void make_room(std::size_t bytes);
    const void* map() const;
  };

  Buffer seen_, which_;
  GLsync done_ = nullptr;
};

}  // namespace esim
