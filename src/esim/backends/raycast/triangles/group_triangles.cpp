#include "esim/backends/raycast/triangles/group_triangles.h"

#include <tbb/task_arena.h>

#include <Eigen/Dense>
#include <cstring>
#include <string>

#include "esim/core/error.h"

namespace esim::inline backends::inline raycast {

TriangleShading::TriangleShading(const Mesh& mesh, std::size_t index, std::uint32_t first_material)
    : material(first_material + mesh.material[index]) {
  const auto& [uv0, uv1, uv2] = mesh.texture_uv[index];
  u0 = uv0.x(), v0 = uv0.y();
  u1 = uv1.x() - uv0.x(), v1 = uv1.y() - uv0.y();
  u2 = uv2.x() - uv0.x(), v2 = uv2.y() - uv0.y();
  const auto& [a, b, c] = mesh.triangles[index];
  place(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]);
}

/// The plane's dual basis gives barycentric coordinates per metre.
void TriangleShading::place(const Eigen::Vector3f& p0, const Eigen::Vector3f& p1, const Eigen::Vector3f& p2) {
  const Eigen::Vector3d e1 = (p1 - p0).cast<double>(), e2 = (p2 - p0).cast<double>();
  const Eigen::Vector3d normal = e1.cross(e2);
  const double area2 = normal.squaredNorm(), per_area2 = area2 > 0 ? 1 / area2 : 0;
  const Eigen::Vector3d dual1 = per_area2 * e2.cross(normal), dual2 = per_area2 * normal.cross(e1);
  Eigen::Map<Eigen::Vector3f>{gradient_u} = (u1 * dual1 + u2 * dual2).cast<float>();
  Eigen::Map<Eigen::Vector3f>{gradient_v} = (v1 * dual1 + v2 * dual2).cast<float>();
}

void throw_on_error(RTCDevice device, const char* what) {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_NONE) return;
  throw UserError(std::string("mesh: Embree cannot ") + what +
                  (error == RTC_ERROR_OUT_OF_MEMORY ? ": out of memory; use a mesh with fewer triangles"
                                                    : ": error code " + std::to_string(error)));
}

RayTriangles::RayTriangles(RTCDevice device, std::span<const Eigen::Vector3f> vertices,
                           std::span<const Corners> triangles, bool moves)
    : device_(device), scene_(rtcNewScene(device)) {
  rtcSetSceneFlags(scene_.get(), moves ? RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_DYNAMIC : RTC_SCENE_FLAG_ROBUST);
  // Slower to build, faster to query.
  rtcSetSceneBuildQuality(scene_.get(), moves ? RTC_BUILD_QUALITY_MEDIUM : RTC_BUILD_QUALITY_HIGH);
  // Embree requires padded buffers: it allocates them, and the data are copied.
  geometry_ = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  if (moves) rtcSetGeometryBuildQuality(geometry_, RTC_BUILD_QUALITY_REFIT);
  void* const to_vertices = rtcSetNewGeometryBuffer(geometry_, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                    sizeof(Eigen::Vector3f), vertices.size());
  void* const to_triangles = rtcSetNewGeometryBuffer(geometry_, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                     sizeof(triangles[0]), triangles.size());
  throw_on_error(device, "store the mesh");
  std::memcpy(to_vertices, vertices.data(), vertices.size_bytes());
  std::memcpy(to_triangles, triangles.data(), triangles.size_bytes());
  rtcCommitGeometry(geometry_);
  rtcAttachGeometry(scene_.get(), geometry_);
  rtcReleaseGeometry(geometry_);
  commit();
}

void RayTriangles::refit(std::span<const Eigen::Vector3f> vertices) {
  std::memcpy(rtcGetGeometryBufferData(geometry_, RTC_BUFFER_TYPE_VERTEX, 0), vertices.data(), vertices.size_bytes());
  rtcUpdateGeometryBuffer(geometry_, RTC_BUFFER_TYPE_VERTEX, 0);
  rtcCommitGeometry(geometry_);
  commit();
}

/// One thread builds the hierarchy, so that it is the same in every run. (The device's own limit on threads would
/// affect the complete process.)
void RayTriangles::commit() {
  tbb::task_arena(1).execute([this] { rtcJoinCommitScene(scene_.get()); });
  throw_on_error(device_, "build the scene");
}

bool TriangleUse::wants_tree(std::size_t triangles) const {
  constexpr std::size_t kMaxForRays = 20'000;  // with more, most parts of an image see too many of them
  return surfaces || triangles <= kMaxForRays;
}

}  // namespace esim::inline backends::inline raycast
