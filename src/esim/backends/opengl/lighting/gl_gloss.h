#pragma once

#include <epoxy/gl.h>

#include <memory>
#include <vector>

#include "esim/backends/opengl/gl_scene.h"
#include "esim/render/pinhole_view.h"
#include "esim/scene/scene.h"

// Private to backends/opengl: includes epoxy/gl.h.
namespace esim::inline backends::inline opengl {

/// What glossy surfaces need besides suns and lamps: rectangles that shine, the environment, and the sky. Belongs to
/// the current context.
class GlGloss {
 public:
  /// Throws UserError if the lights cast shadows that shadow maps do not support.
  GlGloss(const Lighting& lighting, GlScene& scene);

  /// Uploads the rectangles of `lighting`, which is in the world frame.
  void upload(const Lighting& lighting, const SE3& T_camera_world);

  /// Sets the uniforms of the current program, which must contain the glossy shader.
  void bind_to(GLuint program) const;
  void bind_part(GLuint program, const GlScene::Part& part) const;

  /// Draws the environment into the whole framebuffer, if it is visible. Changes the program and the vertices.
  void draw_sky(const PinholeView& view, GLuint no_vertices) const;

 private:
  std::shared_ptr<const Environment> environment_;
  bool visible_;
  GLuint surroundings_ = 0, areas_ = 0, sky_ = 0, sky_program_ = 0;
  int area_count_ = 0;
  std::vector<GLint> maps_;
  SE3 T_camera_world_;
};

}  // namespace esim::inline backends::inline opengl
