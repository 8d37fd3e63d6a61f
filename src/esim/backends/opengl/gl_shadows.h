#pragma once

#include <epoxy/gl.h>

#include <Eigen/Core>
#include <vector>

#include "esim/backends/opengl/gl_scene.h"
#include "esim/render/renderer.h"
#include "esim/scene/scene.h"

namespace esim {

/// Depth as a scene's lights see it: a layer for each sun, six for each point light. What stands still is drawn once,
/// and for good: its texels lie still in the world, so that its shadows' edges do not shimmer as the camera moves. What
/// moves has maps of its own, drawn anew for every request. Ends with the current context. Private to the renderer.
class GlShadows {
 public:
  /// Both outlive it. Throws UserError where there are more lights than the device has layers for.
  GlShadows(const Scene& scene, const GlScene& drawn);

  /// Draws what moves, and gives all that shaders need to those that follow. Changes the framebuffer, the viewport, the
  /// scissor, the program and the vertices.
  void draw(const RenderRequest& request);

  /// Sets the uniforms of a program in use that has the shader of shadows.
  void bind_to(GLuint program) const;

 private:
  /// What a light sees of a part of the scene.
  struct View {
    Eigen::Matrix4d clip_from_world;
    double texel = 0;  ///< width in m where w of clip space is 1
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

  Maps make_maps(double most_texels) const;
  void draw_views(const Maps& maps, const std::vector<Placed>& objects) const;
  void view_points(Maps& maps) const;
  View still_sun(const Scene& scene, const SunLight& sun) const;
  View moving_sun(const std::vector<Ball>& balls, const SunLight& sun) const;
  void upload_views(const SE3& T_world_camera) const;

  const GlScene& drawn_;
  Lighting lighting_;
  int layers_ = 0;
  std::vector<Ball> balls_;  // of the moving objects, in their frames
  Maps still_, moving_;
  GLuint framebuffer_ = 0, program_ = 0, views_ = 0;
  SE3 T_world_camera_;
};

}  // namespace esim
