#pragma once

#include <epoxy/gl.h>

#include <Eigen/Core>
#include <vector>

#include "esim/backends/opengl/gl_scene.h"
#include "esim/render/renderer.h"
#include "esim/scene/scene.h"

// Private to backends/opengl: includes epoxy/gl.h.
namespace esim::inline backends::inline opengl {

/// Shadow maps: a layer for each sun, six for each point light. Static objects are drawn once: their texels are fixed
/// in the world, so that the edges of their shadows do not shimmer when the camera moves. Moving objects have separate
/// maps, which are drawn again for every request. Belongs to the current context.
class GlShadows {
 public:
  /// Both must outlive it. Throws UserError if the device does not have enough layers for the lights.
  GlShadows(const Scene& scene, const GlScene& drawn);

  /// Draws the moving objects, and uploads the data for the shaders. Changes the framebuffer, the viewport, the
  /// scissor, the program and the vertices.
  void draw(const RenderRequest& request);

  /// Sets the uniforms of the current program, which must contain the shadow shader.
  void bind_to(GLuint program) const;

 private:
  /// A light's view of a part of the scene.
  struct View {
    Eigen::Matrix4d clip_from_world;
    double texel = 0;  ///< width in m at w = 1 of clip space
    bool used = false;
  };
  /// Layers of depth, one per view.
  struct Maps {
    GLuint texture = 0;
    int size = 0;  ///< texels, square
    std::vector<View> views;
  };
  /// Around an object, in the object's frame.
  struct Ball {
    Eigen::Vector3d centre;
    double radius;
  };
  struct Placed {
    const GlScene::Object* object;
    Eigen::Matrix4d world_from_object;
  };

  Maps make_maps(double max_texels) const;
  Ball ball_of(std::size_t moving, TimeNs t) const;
  void draw_views(const Maps& maps, const std::vector<Placed>& objects) const;
  void view_points(Maps& maps) const;
  View still_sun(const Scene& scene, const SunLight& sun) const;
  View moving_sun(const std::vector<Ball>& balls, const SunLight& sun) const;
  void upload_views(const SE3& T_world_camera) const;

  const GlScene& drawn_;
  Lighting lighting_;
  int layers_ = 0;
  std::vector<Ball> balls_;  // of the moving objects, in their frames, before they deform
  Maps still_, moving_;
  GLuint framebuffer_ = 0, program_ = 0, views_ = 0;
  SE3 T_world_camera_;
};

}  // namespace esim::inline backends::inline opengl
