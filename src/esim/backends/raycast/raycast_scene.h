#pragma once

#include <embree3/rtcore.h>

#include <vector>

#include "esim/backends/raycast/raycast_renderer.h"

namespace esim {

/// What shading needs to know of a triangle. Texture coordinates are uv0 + b1 uv1 + b2 uv2 (barycentric b), and
/// change by (gradient_u, gradient_v) per metre in its plane.
struct TriangleShading {
  float u0, v0, u1, v1, u2, v2;
  float gradient_u[3], gradient_v[3];
  std::uint32_t material;
};

class RaycastScene {
 public:
  explicit RaycastScene(const Scene& scene);
  ~RaycastScene();
  RaycastScene(const RaycastScene&) = delete;
  RaycastScene& operator=(const RaycastScene&) = delete;

  RTCScene scene() const { return scene_; }
  int packet_size() const { return packet_size_; }
  const TriangleShading& triangle(unsigned index) const { return triangles_[index]; }
  const Material& material(unsigned index) const { return materials_[index]; }

 private:
  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
  int packet_size_ = 4;
  std::vector<TriangleShading> triangles_;
  std::vector<Material> materials_;
};

}  // namespace esim
