#pragma once

#include <epoxy/gl.h>

#include <Eigen/Geometry>
#include <vector>

#include "esim/backends/opengl/gl_buffer.h"
#include "esim/render/renderer.h"
#include "esim/scene/splats/splat_objects.h"

// Private to backends/opengl: includes epoxy/gl.h.
namespace esim::inline backends::inline opengl {

/// The splats of a scene on the device. Belongs to the current context.
class GlSplatScene {
 public:
  /// Throws UserError if an object is too large for the device.
  explicit GlSplatScene(const std::vector<SplatObject>& objects);

  GLuint size() const { return size_; }  ///< splats of all objects

  /// Projects all splats by a program of kProjectShader, whose other uniforms are set.
  void project(GLuint program, const RenderRequest& request, float pixel_area) const;

 private:
  struct Object {
    GlBuffer splats, harmonics;
    GLuint first, count;
    int degree;
    SplatFilter filter;
    std::size_t number;  // 0: static; i + 1: the i-th moving object of requests
    Eigen::Quaterniond to_object;
  };

  std::vector<Object> objects_;
  GLuint size_ = 0;
};

/// How many items of this size shaders of the device can access.
std::size_t max_gl_items(std::size_t bytes_each);

/// Throws UserError if it is fewer.
void require_gl_items(std::size_t items, std::size_t bytes_each);

}  // namespace esim::inline backends::inline opengl
