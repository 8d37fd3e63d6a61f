#pragma once

#include <epoxy/gl.h>

#include <vector>

#include "esim/backends/opengl/gl_buffer.h"
#include "esim/backends/opengl/gl_targets.h"
#include "esim/render/sample.h"

// Private to backends/opengl: includes epoxy/gl.h.
namespace esim::inline backends::inline opengl {

/// An asynchronous copy of pixels from the device to memory. Use and destroy it with its context current.
class GlReadBack {
 public:
  /// Begins to copy E, Z and V of the tiles, with `with_objects` the visible objects, and the points of surfaces, if
  /// the target has these, after all previous draw calls. Discards an earlier copy that is not finished.
  void start(const GlTarget& target, const std::vector<Tile>& tiles, bool with_objects);

  /// Waits for the pixels and writes them to `sample`, which must have the right size and the list of tiles.
  void finish(Sample& sample);

 private:
  // To which the device writes pixels and from which the processor reads them
  GlBuffer seen_{GL_MAP_READ_BIT | GL_CLIENT_STORAGE_BIT}, which_{GL_MAP_READ_BIT | GL_CLIENT_STORAGE_BIT},
      place_{GL_MAP_READ_BIT | GL_CLIENT_STORAGE_BIT};
  GLsync done_ = nullptr;
};

}  // namespace esim::inline backends::inline opengl
