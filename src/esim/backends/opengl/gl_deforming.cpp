#include "esim/backends/opengl/gl_deforming.h"

#include <Eigen/Geometry>
#include <utility>

#include "esim/render/motion_field.h"

namespace esim::inline backends::inline opengl {

GlDeformingObject::GlDeformingObject(const SceneObject& object, std::vector<std::uint32_t> order, std::size_t first,
                                     std::vector<GlVertex> vertices, std::size_t number)
    : deformation_(object.deformation),
      triangles_(object.mesh.triangles),
      order_(std::move(order)),
      first_(first),
      vertices_(std::move(vertices)),
      number_(number) {}

void GlDeformingObject::deform(TimeNs t, GLuint buffer) {
  if (deformed_ != nullptr && t == t_) return;
  auto deformed = std::make_shared<DeformedVertices>();
  deformation_->evaluate(t, *deformed);
  for (std::size_t i = 0; i < vertices_.size(); ++i) {
    const std::uint32_t vertex = triangles_[order_[i / 3]][i % 3];
    vertices_[i].position = deformed->positions[vertex];
    if (!deformed->normals.empty()) vertices_[i].normal = deformed->normals[vertex];
  }
  glNamedBufferSubData(buffer, static_cast<GLintptr>(first_ * sizeof(GlVertex)),
                       static_cast<GLsizeiptr>(vertices_.size() * sizeof(GlVertex)), vertices_.data());
  t_ = t, deformed_ = std::move(deformed);
}

std::pair<Eigen::Vector3f, float> GlDeformingObject::ball(TimeNs t) const {
  const Eigen::AlignedBox3f box = deformation_->bounds(t);
  return {box.center(), 0.5F * box.diagonal().norm()};
}

Eigen::Vector3f GlDeformingObject::take(SurfacePoint& point, const Eigen::Vector3d& position,
                                        const DeformedVertices& vertices) const {
  point.triangle = order_[point.triangle];
  const auto& [a, b, c] = triangles_[point.triangle];
  const auto corner = [&](std::uint32_t vertex) { return Eigen::Vector3d(vertices.positions[vertex].cast<double>()); };
  const Eigen::Vector3d first = corner(a), e1 = corner(b) - first, e2 = corner(c) - first, to = position - first;
  const Eigen::Vector3d normal = e1.cross(e2);
  if (const double area2 = normal.squaredNorm(); area2 > 0) {
    point.b1 = static_cast<float>(e2.cross(normal).dot(to) / area2);
    point.b2 = static_cast<float>(normal.cross(e1).dot(to) / area2);
  }
  return at_point(vertices.velocities, triangles_[point.triangle], point);
}

void complete_deforming(const std::vector<GlDeformingObject>& objects, const GlDeformed& deformed,
                        const RenderRequest& request, const PixelRays& rays, Sample& sample) {
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const SE3 T_object_camera =
        request.objects[objects[i].number() - 1].T_world_body.inverse() * request.camera.T_world_body;
    const Eigen::Matrix3d R_object_camera = T_object_camera.rotation.toRotationMatrix();
    const Eigen::Matrix3f R_camera_object = R_object_camera.transpose().cast<float>();
    for (const Tile& tile : request.tiles) {
      for (int y = tile.y; y < tile.y + tile.height; ++y) {
        for (int x = tile.x; x < tile.x + tile.width; ++x) {
          if (sample.object(x, y) != objects[i].number()) continue;
          const Eigen::Vector3d bearing(double{rays.x(x, y)}, double{rays.y(x, y)}, 1);
          const Eigen::Vector3d position =
              R_object_camera * (double{sample.depth(x, y)} * bearing) + T_object_camera.translation;
          const Eigen::Vector3f velocity = objects[i].take(sample.surface(x, y), position, *deformed[i]);
          add_to_motion_field(rays, x, y, R_camera_object * velocity, sample);
        }
      }
    }
  }
}

}  // namespace esim::inline backends::inline opengl
