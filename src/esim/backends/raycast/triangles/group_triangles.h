#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "esim/backends/raycast/embree.h"
#include "esim/backends/raycast/triangles/triangle_tree.h"
#include "esim/scene/mesh.h"

// Private to backends/raycast.
namespace esim::inline backends::inline raycast {

/// The triangle beyond a side of another.
class NextTriangle {
 public:
  NextTriangle() = default;
  /// `apart`: its index minus that of the other, not 0; `continues`: the surface does.
  NextTriangle(std::int32_t apart, bool continues) : word_(2 * apart + (continues ? 1 : 0)) {}

  bool exists() const { return word_ != 0; }
  std::int32_t apart() const { return word_ >> 1; }
  bool continues() const { return (word_ & 1) != 0; }

 private:
  std::int32_t word_ = 0;
};

/// A triangle's data for shading, in one cache line. Texture coordinates are uv0 + b1 uv1 + b2 uv2 (barycentric b), and
/// have the gradients (gradient_u, gradient_v) per metre in its plane.
struct alignas(64) TriangleShading {
  float u0 = 0, v0 = 0, u1 = 0, v1 = 0, u2 = 0, v2 = 0;
  float gradient_u[3] = {}, gradient_v[3] = {};
  std::uint32_t material = 0;
  std::array<NextTriangle, 3> next{};  ///< beyond the side opposite each corner; see connect()

  TriangleShading() = default;
  /// `first_material`: of the mesh.
  TriangleShading(const Mesh& mesh, std::size_t index, std::uint32_t first_material);

  /// Computes the gradients for other corners. Those of a degenerate triangle, which is never hit, are 0.
  void place(const Eigen::Vector3f& p0, const Eigen::Vector3f& p1, const Eigen::Vector3f& p2);
};

/// Fills `next` of the triangles of a mesh, in its order: with the triangle that has the same side, by the positions of
/// its ends, if there is only one. The surface continues there if the material, the texture coordinates and, if it is
/// lit, the normals do so.
void connect(const Mesh& mesh, bool lit, std::span<TriangleShading> triangles);

using CornerNormals = std::array<Eigen::Vector3f, 3>;
using Corners = std::array<std::uint32_t, 3>;

struct ReleaseDevice {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct ReleaseScene {
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
using DevicePointer = std::unique_ptr<RTCDeviceTy, ReleaseDevice>;
using ScenePointer = std::unique_ptr<RTCSceneTy, ReleaseScene>;

/// Throws UserError if the device reports an error of what it was asked to do.
void throw_on_error(RTCDevice device, const char* what);

/// Triangles as rays find them.
class RayTriangles {
 public:
  RayTriangles() = default;

  /// `moves`: their vertices will move.
  RayTriangles(RTCDevice device, std::span<const Eigen::Vector3f> vertices, std::span<const Corners> triangles,
               bool moves);

  /// Moves them to as many other vertices, in the same hierarchy.
  void refit(std::span<const Eigen::Vector3f> vertices);

  /// Null without triangles.
  RTCScene scene() const { return scene_.get(); }

 private:
  void commit();

  RTCDevice device_ = nullptr;
  ScenePointer scene_;
  RTCGeometry geometry_ = nullptr;  // owned by the scene
};

/// The triangles of a group, as a camera and shadows look for them.
struct GroupTriangles {
  RayTriangles rays;  ///< empty if no ray is needed
  TriangleTree tree;  ///< empty for rays if there are many triangles
};

/// What the triangles of a group are prepared for.
struct TriangleUse {
  RTCDevice device;
  bool surfaces;  ///< they are projected, instead of traced
  bool rays;      ///< of the camera or of shadows
  bool normals;   ///< light needs normals at their corners

  /// Whether so many triangles are in a tree.
  bool wants_tree(std::size_t triangles) const;
};

}  // namespace esim::inline backends::inline raycast
