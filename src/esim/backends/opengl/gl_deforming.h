#pragma once

#include <epoxy/gl.h>

#include <array>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "esim/render/pixel_rays.h"
#include "esim/render/renderer.h"
#include "esim/scene/scene.h"

// Private to backends/opengl: includes epoxy/gl.h.
namespace esim::inline backends::inline opengl {

/// A vertex of the surface program. Vertices are not shared, since texture coordinates belong to a triangle's corner.
struct GlVertex {
  Eigen::Vector3f position, normal;  // a normal of zero means a flat triangle
  Eigen::Vector2f texture_uv;
};

/// A deforming object in a scene's vertex buffer.
class GlDeformingObject {
 public:
  /// `order`: of the mesh's triangles in the buffer, where its vertices begin at `first`. `number`: of the moving
  /// object, from 1.
  GlDeformingObject(const SceneObject& object, std::vector<std::uint32_t> order, std::size_t first,
                    std::vector<GlVertex> vertices, std::size_t number);

  /// Moves the vertices in the buffer to a time.
  void deform(TimeNs t, GLuint buffer);

  /// The vertices at the time of the last call of deform().
  std::shared_ptr<const DeformedVertices> vertices() const { return deformed_; }

  std::size_t number() const { return number_; }

  /// A ball that contains it at a time, in its frame: centre and radius.
  std::pair<Eigen::Vector3f, float> ball(TimeNs t) const;

  /// Makes a point of the mesh from the number of its triangle in the buffer and its position in the object's frame, m,
  /// which barycentric coordinates from the device only approximate if a lens distorts. Returns the point's velocity in
  /// the object's frame at the time of `vertices`, m/s.
  Eigen::Vector3f take(SurfacePoint& point, const Eigen::Vector3d& position, const DeformedVertices& vertices) const;

 private:
  std::shared_ptr<const Deformation> deformation_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::vector<std::uint32_t> order_;
  std::size_t first_;
  std::vector<GlVertex> vertices_;
  std::size_t number_;
  TimeNs t_ = 0;
  std::shared_ptr<const DeformedVertices> deformed_;
};

/// The vertices of deforming objects at the time of a request.
using GlDeformed = std::vector<std::shared_ptr<const DeformedVertices>>;

/// Completes a sample from the device: the points of deforming objects, and what their motion adds to V.
void complete_deforming(const std::vector<GlDeformingObject>& objects, const GlDeformed& deformed,
                        const RenderRequest& request, const PixelRays& rays, Sample& sample);

}  // namespace esim::inline backends::inline opengl
